# SPDX-License-Identifier: Apache-2.0
"""The gripper and the table of the tests that need no model of the robot."""

from uncom_tiago_exec.robot.gripper_shape import GripperShape

TABLE_Z = 0.72  # height of the table's top in base_footprint [m]
GRIPPER = GripperShape(tip=0.1, palm=-0.029, thickness=0.01, half_width=0.025, open=0.09, body=(0.0516, 0.032))
