# SPDX-License-Identifier: Apache-2.0
"""What /joint_states tell: positions, when each joint last moved, and whether they still arrive."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping

import numpy as np
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from sensor_msgs.msg import JointState

from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.ros.debounce import Debounce
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions


class JointStateListener:
    """Keeps the latest joint states. Thread safe."""

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        timeout_s: float,
        options: RobotConnectionOptions = ROBOT_CONNECTION,
    ) -> None:
        """Subscribe on a node; joint states older than `timeout_s` [s] of its clock count as silence."""
        self._node = node
        self._timeout_s = timeout_s
        self._options = options
        self._lock = threading.Lock()
        self._arrived = threading.Event()
        self._positions: dict[str, float] = {}
        self._moved_s: dict[str, float] = {}  # when each joint last moved
        self._stamp_s = -np.inf
        node.create_subscription(JointState, "/joint_states", self._on_joints, 10, callback_group=group)

    def _on_joints(self, msg: JointState) -> None:
        now_s = self._now_s()
        with self._lock:
            for name, position in zip(msg.name, msg.position, strict=False):
                if abs(position - self._positions.get(name, np.inf)) > self._options.least_motion:
                    self._moved_s[name] = now_s
                self._positions[name] = position
            self._stamp_s = now_s
        self._arrived.set()

    @property
    def is_alive(self) -> bool:
        """Whether joint states arrive."""
        return self._now_s() - self._stamp_s < self._timeout_s

    def positions(self) -> dict[str, float]:
        """Return the position of every joint [rad, m].

        Raises:
            MotionError: joint states fell silent.
        """
        silence = Debounce(self._options.silence_s)
        while not self.is_alive:
            if silence.holds(True):
                raise MotionError("no joint states arrive on /joint_states; is the robot running?")
            self._arrived.wait(self._options.poll_s)
            self._arrived.clear()
        with self._lock:
            return dict(self._positions)

    def last_motion_s(self, joints: Iterable[str]) -> float:
        """Return when one of some joints last moved [s]."""
        with self._lock:
            return max(self._moved_s.get(joint, -np.inf) for joint in joints)

    def distance_to(self, goal: Mapping[str, float]) -> float:
        """Return how far the joint is that is farthest from its goal [rad, m]; one that is not known is there."""
        with self._lock:
            return max(abs(self._positions.get(joint, position) - position) for joint, position in goal.items())

    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9
