# SPDX-License-Identifier: Apache-2.0
"""The node by which the demo starts the person and receives the true states for scoring."""

from __future__ import annotations

import threading
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger
from uncom_common.conversions import seconds_from_msg

from uncom_interfaces.msg import SimState
from uncom_sim.driver.ros.conversions import object_states_from_msg
from uncom_sim.types import ObjectState


class DemoNode(Node):
    """Keeps the first and the newest true state; only the scorer reads them, none of the six nodes does."""

    def __init__(self, **node_options: Any) -> None:
        """Subscribe to the true states, and make the client of /sim/start."""
        super().__init__("uncom_demo", **node_options)
        self._lock = threading.Lock()
        self._first: SimState | None = None
        self._last: SimState | None = None
        self._done_s: float | None = None
        self._start = self.create_client(Trigger, "/sim/start")
        self.create_subscription(SimState, "/sim/state", self._keep, 10)

    def _keep(self, msg: SimState) -> None:
        with self._lock:
            self._first = self._first or msg
            self._last = msg
            if msg.person_done and self._done_s is None:
                self._done_s = seconds_from_msg(msg.header.stamp)

    @property
    def simulator_is_up(self) -> bool:
        """Whether the simulator has told its state and can be started."""
        with self._lock:
            return self._last is not None and self._start.service_is_ready()

    @property
    def now_s(self) -> float:
        """Time of the newest state [s, ROS clock]."""
        with self._lock:
            return seconds_from_msg(self._last.header.stamp) if self._last is not None else 0.0

    @property
    def person_done_s(self) -> float | None:
        """When the person had spoken, pointed and left [s, ROS clock]; None before that."""
        with self._lock:
            return self._done_s

    def begin(self) -> None:
        """Tell the person to begin; the objects as they stand now are what they moved from."""
        with self._lock:
            self._first = self._last
        self._start.call_async(Trigger.Request())

    def truth(self) -> tuple[tuple[ObjectState, ...], tuple[ObjectState, ...], int, int]:
        """Return the objects at the person's start and now, and contacts of robot with table and with bystanders."""
        with self._lock:
            first, last = self._first, self._last
        if first is None or last is None:
            return (), (), 0, 0
        contacts = int(last.robot_table_contacts), int(last.robot_bystander_contacts)
        return (object_states_from_msg(first), object_states_from_msg(last), *contacts)
