# SPDX-License-Identifier: Apache-2.0
"""Dimensions of TIAGo++ that several packages need."""

from __future__ import annotations

# Distance of each shoulder from the middle plane of the robot [m]: y of the joints arm_left_1_joint and
# arm_right_1_joint in base_footprint (REP 103: left is positive), from the robot's URDF (tiago_dual_description).
SHOULDER_Y_M = 0.19
