# SPDX-License-Identifier: Apache-2.0
"""Drives the robot's base straight on by its odometry. Called from the engine's thread only."""

from __future__ import annotations

import threading

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node

from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.execution.base_driver import drive_velocity
from uncom_tiago_exec.execution.options import BASE_DRIVE
from uncom_tiago_exec.ros.options import ROBOT_CONNECTION, RobotConnectionOptions

_BASE = "/mobile_base_controller"


def drive_base(
    node: Node,
    group: CallbackGroup,
    distance: float,
    stop: threading.Event,
    frame: str,
    options: RobotConnectionOptions = ROBOT_CONNECTION,
) -> None:
    """Drive straight on by a distance [m], back if negative. The odometry is listened to only meanwhile.

    Args:
        node: whose clock counts.
        group: in which odometry is handled.
        distance: along the heading of the base [m].
        stop: set once the base is to stand still.
        frame: of the base.
        options: of the connection.

    Raises:
        MotionError: there is no odometry, or the base did not get there in time.
        StoppedError: `stop` was set; the base is told to stand still.
    """
    places: list[tuple[float, float]] = []
    heard = threading.Event()

    def on_odometry(msg: Odometry) -> None:
        places.append((msg.pose.pose.position.x, msg.pose.pose.position.y))
        heard.set()

    def now() -> float:
        return float(node.get_clock().now().nanoseconds) * 1e-9

    def tell(linear: float) -> None:
        message = TwistStamped()
        message.header.frame_id = frame
        message.header.stamp = node.get_clock().now().to_msg()
        message.twist.linear.x = linear
        commands.publish(message)

    listening = node.create_subscription(Odometry, f"{_BASE}/odom", on_odometry, 10, callback_group=group)
    commands = node.create_publisher(TwistStamped, f"{_BASE}/cmd_vel", 10)
    began = now()
    deadline = began + 2.0 * abs(distance) / BASE_DRIVE.speed_mps + options.overtime_s
    try:
        while True:
            if stop.is_set():
                raise StoppedError("stopped on request")
            if now() > deadline or (not places and now() - began > options.odometry_s):
                raise MotionError(f"the base does not drive; are {_BASE}/odom and {_BASE}/cmd_vel there?")
            heard.wait(options.poll_s)
            heard.clear()
            if not places:
                continue
            (x, y), (x0, y0) = places[-1], places[0]
            went = float(np.copysign(np.hypot(x - x0, y - y0), distance))
            velocity = drive_velocity(distance - went)
            tell(velocity)
            if velocity == 0.0:
                return
    finally:
        tell(0.0)
        node.destroy_subscription(listening)
        node.destroy_publisher(commands)
