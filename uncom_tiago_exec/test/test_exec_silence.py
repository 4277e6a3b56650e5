# SPDX-License-Identifier: Apache-2.0
"""A controller that neither speaks nor moves is noticed; one whose messages only come late is not taken for dead."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from sensor_msgs.msg import JointState
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.ros.debounce import Debounce
from uncom_tiago_exec.ros.ros_robot import RosRobot
from uncom_tiago_exec.ros.trajectory_clients import CONTROLLERS
from uncom_tiago_exec.types import Trajectory

DOMAIN = 83
TORSO, ARM = "torso_controller", "arm_left_controller"
JOINTS = CONTROLLERS[TORSO] + CONTROLLERS[ARM]
DURATION_S = 3.0


class MuteControllers:
    """Torso and arm take goals and never say how far they are; the arm moves at a share of the pace of its goal."""

    def __init__(self, context, pace):
        self.node = rclpy.create_node("mute", context=context)
        self.pace = pace
        self.begun = None
        self.finished = threading.Event()
        group = ReentrantCallbackGroup()
        self.servers = [
            ActionServer(
                self.node,
                FollowJointTrajectory,
                f"/{name}/follow_joint_trajectory",
                self._carry_out,
                callback_group=group,
            )
            for name in (TORSO, ARM)
        ]
        self.states = self.node.create_publisher(JointState, "/joint_states", 10)
        self.node.create_timer(0.02, self._tell, callback_group=group)

    def _now(self):
        return self.node.get_clock().now().nanoseconds * 1e-9

    def _carry_out(self, handle):
        self.begun = self.begun or self._now()
        self.finished.wait(20.0)
        handle.succeed()
        return FollowJointTrajectory.Result()

    def _tell(self):
        share = 0.0 if self.begun is None else min(1.0, self.pace * (self._now() - self.begun) / DURATION_S)
        if share >= 1.0:
            self.finished.set()
        positions = [0.2] + [share * 0.6] * len(CONTROLLERS[ARM])
        self.states.publish(JointState(name=list(JOINTS), position=positions))

    def destroy(self):
        self.finished.set()
        for server in self.servers:
            server.destroy()


def motion():
    times = np.linspace(0.0, DURATION_S, 7)
    positions = np.column_stack([np.full(7, 0.2), *[0.2 * times] * len(CONTROLLERS[ARM])])
    return Trajectory(JOINTS, times, positions, np.zeros_like(positions))


@pytest.fixture
def robot_with():
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    executor = MultiThreadedExecutor(num_threads=6, context=context)
    made = []

    def make(pace):
        mute = MuteControllers(context, pace)
        node = rclpy.create_node("robot", context=context)
        robot = RosRobot(node, ExecutionConfig())
        executor.add_node(mute.node)
        executor.add_node(node)
        made.append(mute)
        threading.Thread(target=executor.spin, daemon=True).start()
        for name in (TORSO, ARM):
            assert robot._controllers.clients[name].wait_for_server(20.0)
        joints = threading.Event()
        node.create_subscription(JointState, "/joint_states", lambda _: joints.set(), 10)
        assert joints.wait(20.0)
        return robot

    yield make
    for mute in made:
        mute.destroy()
    executor.shutdown(timeout_sec=5.0)
    rclpy.shutdown(context=context)


def test_a_controller_that_neither_speaks_nor_moves_stops_the_motion(robot_with):
    robot = robot_with(pace=0.0)
    with pytest.raises(MotionError, match="arm_left_controller fell silent"):
        robot.follow(motion())


def test_controllers_that_do_their_work_without_a_word_are_not_stopped(robot_with):
    """The arm moves as told; the torso has nothing to do. Feedback of neither comes."""
    robot_with(pace=1.0).follow(motion())


def test_silence_counts_only_once_it_has_lasted():
    now = [10.0]
    lasting = Debounce(0.2, lambda: now[0])
    assert not lasting.holds(True)
    now[0] = 10.15
    assert not lasting.holds(True)
    assert not lasting.holds(False)
    now[0] = 10.3
    assert not lasting.holds(True)
    now[0] = 10.55
    assert lasting.holds(True)
