# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: joint positions that bring the left gripper to a pose over the table.

Run it with: ./uncom exec python examples/01_inverse_kinematics.py
"""

import numpy as np
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.robot.robot_model import RobotModel

robot = RobotModel(tiago_urdf())
start = home_positions(0.35, (0.0, -0.95), 0.02)  # torso [m], head pan and tilt [rad], finger openings [m]
group = robot.group("left", start)  # the torso and the seven joints of the left arm

# The grasping frame in base_footprint: x is the approach direction, here straight down, 20 cm over the table.
transform_gripper_to_base = np.eye(4)
transform_gripper_to_base[:3, :3] = np.column_stack([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
transform_gripper_to_base[:3, 3] = 0.6, 0.15, 0.92

solver = IkSolver(group, seed=0)
for q in solver.solutions(transform_gripper_to_base, [group.vector(start)], count=3):
    error_m = np.linalg.norm(group.forward(q)[:3, 3] - transform_gripper_to_base[:3, 3])
    print("torso and arm", np.round(q, 3), f"position error {1000 * error_m:.4f} mm")
