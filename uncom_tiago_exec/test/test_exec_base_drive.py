# SPDX-License-Identifier: Apache-2.0
"""The base behind ROS: it is driven by its odometry, and where it stands is what /tf says."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.executors import MultiThreadedExecutor
from tf2_msgs.msg import TFMessage
from uncom_common.conversions import stamped_transform_to_msg
from uncom_common.transforms import StampedTransform
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.ros.ros_robot import RosRobot
from uncom_tiago_exec.types import ODOM_ORIGIN, BasePose

DOMAIN = 79
PERIOD_S = 0.02


class DrivenBase:
    """Follows velocity commands along its heading, and tells where it is."""

    def __init__(self, context, pose):
        self.node = rclpy.create_node("base", context=context)
        self.pose = pose
        self.velocity = 0.0
        self.driven = threading.Event()
        self.odometry = self.node.create_publisher(Odometry, "/mobile_base_controller/odom", 10)
        self.transforms = self.node.create_publisher(TFMessage, "/tf", 10)
        self.node.create_subscription(TwistStamped, "/mobile_base_controller/cmd_vel", self._on_command, 10)
        self.node.create_timer(PERIOD_S, self._tell)

    def _on_command(self, msg):
        self.velocity = msg.twist.linear.x
        self.driven.set()

    def _tell(self):
        self.pose = self.pose.driven(self.velocity * PERIOD_S)
        msg = Odometry()
        msg.pose.pose.position.x, msg.pose.pose.position.y = self.pose.x, self.pose.y
        self.odometry.publish(msg)
        now_s = self.node.get_clock().now().nanoseconds * 1e-9
        link = StampedTransform(now_s, "odom", "base_footprint", self.pose.transform_base_to_odom)
        self.transforms.publish(TFMessage(transforms=[stamped_transform_to_msg(link)]))


@pytest.fixture
def robot_on():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    executor = MultiThreadedExecutor(num_threads=4, context=context)

    def make(*bases):
        node = rclpy.create_node("robot", context=context)
        robot = RosRobot(node, ExecutionConfig())
        heard = threading.Event()
        node.create_subscription(TFMessage, "/tf", lambda _: heard.set(), 10)
        for each in (node, *(base.node for base in bases)):
            executor.add_node(each)
        threading.Thread(target=executor.spin, daemon=True).start()
        assert not bases or heard.wait(20.0)
        return robot

    make.context = context
    yield make
    executor.shutdown(timeout_sec=5.0)
    rclpy.shutdown(context=context)


def test_a_base_that_stands_turned_is_driven_along_its_heading_and_back(robot_on):
    began = BasePose(1.0, -2.0, 0.7)
    base = DrivenBase(robot_on.context, began)
    robot = robot_on(base)
    pose = robot.base_pose()
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, -2.0, 0.7))
    robot.drive(0.06)
    assert began.distance_ahead(base.pose) == pytest.approx(0.06, abs=0.008)
    assert np.hypot(base.pose.x - began.x, base.pose.y - began.y) == pytest.approx(0.06, abs=0.008)
    robot.drive(-0.06)
    assert began.distance_ahead(base.pose) == pytest.approx(0.0, abs=0.016)


def test_a_stop_ends_a_drive_and_the_base_is_told_to_stand_still(robot_on):
    base = DrivenBase(robot_on.context, ODOM_ORIGIN)
    robot = robot_on(base)
    threading.Thread(target=lambda: base.driven.wait(20.0) and robot.halt(), daemon=True).start()
    with pytest.raises(StoppedError):
        robot.drive(1.0)
    assert base.pose.x < 0.9


def test_a_base_that_nothing_is_heard_of_stands_at_the_origin_and_is_not_driven(robot_on):
    robot = robot_on()
    assert robot.base_pose() == ODOM_ORIGIN
    with pytest.raises(MotionError, match="does not drive"):
        robot.drive(0.06)
