# SPDX-License-Identifier: Apache-2.0
"""The six trajectory controllers of a TIAGo++ with parallel grippers, as its configuration files have them."""

from __future__ import annotations

from uncom_sim.controllers.joint_trajectory import TrajectoryControllerConfig
from uncom_sim.robot.joint_names import ARMS, FINGERS, HEAD, TORSO

TRAJECTORY_CONTROLLERS = (
    TrajectoryControllerConfig("torso_controller", TORSO, goal_tolerance=0.02, goal_time_s=0.6),
    TrajectoryControllerConfig("head_controller", HEAD, goal_tolerance=0.5, goal_time_s=2.0),
    *(
        TrajectoryControllerConfig(f"arm_{side}_controller", joints, goal_tolerance=0.02, goal_time_s=0.6)
        for side, joints in ARMS.items()
    ),
    *(
        TrajectoryControllerConfig(
            f"gripper_{side}_controller", joints, goal_tolerance=0.02, goal_time_s=0.6, hold_margin=0.003
        )
        for side, joints in FINGERS.items()
    ),
)
