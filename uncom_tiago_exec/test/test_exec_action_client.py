# SPDX-License-Identifier: Apache-2.0
"""No answer of a controller is lost, however quickly it comes."""

from __future__ import annotations

import threading
import time

import pytest
import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionServer
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from uncom_tiago_exec.ros.race_free_action_client import RaceFreeActionClient

DOMAIN = 88
NAME = "/quick_controller/follow_joint_trajectory"


class SlowToNote:
    """A client handle after whose sending the thread is held up, so that the answer is there before it goes on."""

    def __init__(self, handle):
        self._handle = handle

    def __getattr__(self, name):
        return getattr(self._handle, name)

    def __enter__(self):
        return self._handle.__enter__()

    def __exit__(self, *error):
        return self._handle.__exit__(*error)

    def send_goal_request(self, request):
        number = self._handle.send_goal_request(request)
        time.sleep(0.3)
        return number


@pytest.fixture
def spun():
    context = Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = Node("client", context=context)
    server_node = Node("server", context=context)

    def succeed(goal):
        goal.succeed()
        return FollowJointTrajectory.Result(error_code=FollowJointTrajectory.Result.SUCCESSFUL)

    server = ActionServer(server_node, FollowJointTrajectory, NAME, succeed)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    executor.add_node(server_node)
    client = RaceFreeActionClient(node, FollowJointTrajectory, NAME)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    yield client
    executor.shutdown(timeout_sec=2.0)
    thread.join(timeout=5.0)
    server.destroy()
    client.destroy()
    node.destroy_node()
    server_node.destroy_node()
    context.try_shutdown()


def test_an_answer_that_comes_before_the_goal_was_noted_is_not_lost(spun):
    assert spun.wait_for_server(timeout_sec=20.0)
    spun._client_handle = SlowToNote(spun._client_handle)
    accepted, finished = threading.Event(), threading.Event()
    future = spun.send_goal_async(FollowJointTrajectory.Goal())
    future.add_done_callback(lambda _: accepted.set())
    assert accepted.wait(10.0)
    future.result().get_result_async().add_done_callback(lambda _: finished.set())
    assert finished.wait(10.0)
