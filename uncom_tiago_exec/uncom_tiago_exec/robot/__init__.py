# SPDX-License-Identifier: Apache-2.0
"""Models of the robot: kinematics, collision shapes with covers and distance maps, gripper, joint names."""
