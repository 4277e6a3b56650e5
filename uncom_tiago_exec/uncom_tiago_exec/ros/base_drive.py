# SPDX-License-Identifier: Apache-2.0
"""Drives the robot's base straight on by its odometry. Called from the engine's thread only."""

from __future__ import annotations

import threading

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.publisher import Publisher

from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.execution.base_driver import drive_velocity
from uncom_tiago_exec.execution.options import BASE_DRIVE
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions

_BASE = "/mobile_base_controller"


class BaseDrive:
    """One robot's mobile base; its odometry is listened to only while it drives."""

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        stop: threading.Event,
        frame: str,
        options: RobotConnectionOptions = ROBOT_CONNECTION,
    ) -> None:
        """Make nothing yet.

        Args:
            node: whose clock counts.
            group: in which odometry is handled.
            stop: set once the base is to stand still.
            frame: of the base.
            options: of the connection.
        """
        self._node = node
        self._group = group
        self._stop = stop
        self._frame = frame
        self._options = options
        self._arrived = threading.Event()
        self._places: list[tuple[float, float]] = []

    def drive(self, distance: float) -> None:
        """Drive straight on by a distance [m], back if negative.

        Raises:
            MotionError: there is no odometry, or the base did not get there in time.
            StoppedError: it was stopped on request; the base is told to stand still.
        """
        self._places = []
        odometry = self._node.create_subscription(
            Odometry, f"{_BASE}/odom", self._on_odometry, 10, callback_group=self._group
        )
        commands = self._node.create_publisher(TwistStamped, f"{_BASE}/cmd_vel", 10)
        try:
            self._follow(distance, commands)
        finally:
            commands.publish(self._command(0.0))
            self._node.destroy_subscription(odometry)
            self._node.destroy_publisher(commands)

    def _follow(self, distance: float, commands: Publisher) -> None:
        """Command velocities until the odometry says that the base is there."""
        began_s = self._now_s()
        deadline_s = began_s + 2.0 * abs(distance) / BASE_DRIVE.speed_mps + self._options.overtime_s
        while True:
            if self._stop.is_set():
                raise StoppedError("stopped on request")
            now_s = self._now_s()
            if now_s > deadline_s or (not self._places and now_s - began_s > self._options.odometry_s):
                raise MotionError(f"the base does not drive; are {_BASE}/odom and {_BASE}/cmd_vel there?")
            self._arrived.wait(self._options.poll_s)
            self._arrived.clear()
            if not self._places:
                continue
            (x, y), (x0, y0) = self._places[-1], self._places[0]
            driven = float(np.copysign(np.hypot(x - x0, y - y0), distance))
            velocity = drive_velocity(distance - driven)
            commands.publish(self._command(velocity))
            if velocity == 0.0:
                return

    def _on_odometry(self, msg: Odometry) -> None:
        self._places.append((msg.pose.pose.position.x, msg.pose.pose.position.y))
        self._arrived.set()

    def _command(self, linear: float) -> TwistStamped:
        """Return the command to drive at a velocity along the heading [m/s]."""
        message = TwistStamped()
        message.header.frame_id = self._frame
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.twist.linear.x = linear
        return message

    def _now_s(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9
