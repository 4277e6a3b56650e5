# SPDX-License-Identifier: Apache-2.0
"""A simulated estimator of 6-DoF poses, as a robot may have one beside UNCOM (paper: iChores, GDRNet++).

It stands for a system outside: it reads the truth of the world, adds an estimator's errors, and publishes what the
optional input /uncom/object_poses takes: a pose and a mesh of each object. Nothing starts it by itself; beside a graph
that runs: python -m uncom_sim.external_poses_node
"""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.node import Node
from shape_msgs.msg import Mesh
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import matrix_from_pose_msg, pose_to_msg, seconds_from_msg
from uncom_common.transforms import FloatArray
from uncom_perception.conversions import mesh_to_msg

from uncom_interfaces.msg import ObjectPose, ObjectPoses, SimState
from uncom_sim.driver.ros.conversions import object_states_from_msg
from uncom_sim.pose_estimator.pose_estimator import ExternalPosesConfig, PoseEstimator, mesh_of


class ExternalPosesNode(ConfiguredNode[ExternalPosesConfig]):
    """Answers states of the world with the poses that an estimator would give, in the frame of the robot's base."""

    def __init__(self, **node_options: Any) -> None:
        """Declare the parameters, and subscribe to the true states and the odometry."""
        super().__init__("external_poses_node", ExternalPosesConfig, **node_options)
        self._estimator = PoseEstimator(self.config)
        self._base: FloatArray = np.eye(4)
        self._last_s = -np.inf
        self._out = self.create_publisher(ObjectPoses, "/uncom/object_poses", 10)
        self.create_subscription(SimState, "/sim/state", self._on_state, 10)
        # the truth is in the frame in which the base began, estimates are in that in which it is
        self.create_subscription(Odometry, "/mobile_base_controller/odom", self._on_odometry, 10)

    def _on_odometry(self, msg: Odometry) -> None:
        self._base = matrix_from_pose_msg(msg.pose.pose)

    def _on_state(self, state: SimState) -> None:
        stamp_s = seconds_from_msg(state.header.stamp)
        if 0.0 <= stamp_s - self._last_s < 1.0 / self.config.rate_hz - 1e-6:
            return
        self._last_s = stamp_s
        msg = ObjectPoses(header=state.header, backend="simulated estimator")
        for found in self._estimator.estimate(object_states_from_msg(state), self._base):
            item = ObjectPose(label=found.label, score=found.score, pose=pose_to_msg(found.pose))
            if len(found.triangles):
                item.mesh = _mesh(found.label)
            msg.poses.append(item)
        self._out.publish(msg)


@cache
def _mesh(kind: str) -> Mesh:
    """Write the mesh of a kind, once: that takes as long as ten pictures."""
    return mesh_to_msg(*mesh_of(kind))


def main(args: list[str] | None = None) -> None:
    """Run the node."""

    def make() -> Node:
        return ExternalPosesNode()

    sys.exit(run_node(make, args))


if __name__ == "__main__":
    main()
