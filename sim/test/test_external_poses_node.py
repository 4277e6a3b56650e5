# SPDX-License-Identifier: Apache-2.0
"""The simulated estimator of poses."""

from __future__ import annotations

import threading

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from uncom_common.conversions import header_to_msg, matrix_from_pose_msg, pose_to_msg
from uncom_sim.external_poses_node import ExternalPosesNode

from uncom_interfaces.msg import ObjectPoses, SimObject, SimState


def test_poses_are_near_the_truth_and_carry_its_stamp():
    """Positions are off by millimetres, not equal, and all things are found when all are to be found."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=63)
    executor = SingleThreadedExecutor(context=context)
    every = [rclpy.parameter.Parameter("found", value=1.0)]
    node = ExternalPosesNode(context=context, parameter_overrides=every)
    other = rclpy.create_node("other", context=context)
    received, got = [], threading.Event()

    def keep(msg):
        received.append(msg)
        got.set()

    other.create_subscription(ObjectPoses, "/uncom/object_poses", keep, 10)
    truth = other.create_publisher(SimState, "/sim/state", 10)
    for each in (node, other):
        executor.add_node(each)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    pose = np.eye(4)
    pose[:3, 3] = (0.6, -0.1, 0.75)
    state = SimState(header=header_to_msg(3.5, "base_footprint"))
    state.objects = [SimObject(id="a", kind="mug", pose=pose_to_msg(pose))]
    try:
        while not got.wait(0.05):
            truth.publish(state)
        found = received[0]
        assert found.header == state.header
        assert [p.label for p in found.poses] == ["mug"]
        error = np.linalg.norm(matrix_from_pose_msg(found.poses[0].pose)[:3, 3] - pose[:3, 3])
        assert 0.0 < error < 0.04
    finally:
        executor.shutdown(timeout_sec=2.0)
        node.destroy_node()
        other.destroy_node()
        rclpy.shutdown(context=context)
        thread.join(timeout=5.0)
