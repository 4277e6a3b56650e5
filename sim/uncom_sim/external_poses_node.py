# SPDX-License-Identifier: Apache-2.0
"""A simulated estimator of 6-DoF poses, as a robot may have one beside UNCOM (paper: iChores, GDRNet++).

It stands for a system outside: it reads the truth of the world, adds an estimator's errors, and publishes what the
optional input /uncom/object_poses takes. It is for tests and is started by hand:
python -m uncom_sim.external_poses_node
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from geometry_msgs.msg import Pose
from rclpy.node import Node
from scipy.spatial.transform import Rotation
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import matrix_from_pose_msg, pose_to_msg

from uncom_interfaces.msg import ObjectPose, ObjectPoses, SimState


@dataclass(frozen=True)
class ExternalPosesConfig:
    """Errors of the estimator."""

    sigma_m: float = field(default=0.006, metadata={"description": "standard deviation of positions [m]"})
    sigma_rad: float = field(default=0.05, metadata={"description": "standard deviation of orientations [rad]"})
    found: float = field(default=0.9, metadata={"description": "share of the things that are found in a message"})
    seed: int = field(default=0, metadata={"description": "of the errors"})


class ExternalPosesNode(ConfiguredNode[ExternalPosesConfig]):
    """Answers each state of the world with the poses that an estimator would give."""

    def __init__(self, **node_options: Any) -> None:
        """Subscribe to the truth."""
        super().__init__("external_poses_node", ExternalPosesConfig, **node_options)
        self._rng = np.random.default_rng(self.config.seed)
        self._out = self.create_publisher(ObjectPoses, "/uncom/object_poses", 10)
        self.create_subscription(SimState, "/sim/state", self._on_state, 10)

    def _on_state(self, state: SimState) -> None:
        msg = ObjectPoses(header=state.header, backend="simulated estimator")
        for thing in state.objects:
            if self._rng.random() < self.config.found:
                score = float(self._rng.uniform(0.6, 0.99))
                msg.poses.append(ObjectPose(label=thing.kind, score=score, pose=self._estimate(thing.pose)))
        self._out.publish(msg)

    def _estimate(self, truth: Pose) -> Pose:
        matrix = matrix_from_pose_msg(truth)
        matrix[:3, 3] += self._rng.normal(0.0, self.config.sigma_m, 3)
        turn = Rotation.from_rotvec(self._rng.normal(0.0, self.config.sigma_rad, 3))
        matrix[:3, :3] = turn.as_matrix() @ matrix[:3, :3]
        return pose_to_msg(matrix)


def main(args: list[str] | None = None) -> None:
    """Run the node."""

    def make() -> Node:
        return ExternalPosesNode()

    sys.exit(run_node(make, args))


if __name__ == "__main__":
    main()
