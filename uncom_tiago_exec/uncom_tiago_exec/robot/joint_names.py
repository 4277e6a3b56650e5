# SPDX-License-Identifier: Apache-2.0
"""Names of the joints of a TIAGo++, in the order of its controllers."""

from __future__ import annotations

from uncom_tiago_exec.types import Side

TORSO_JOINT = "torso_lift_joint"
HEAD_JOINTS = ("head_1_joint", "head_2_joint")


def arm_joints(side: Side) -> tuple[str, ...]:
    """Return the seven joints of an arm in the order of its controller."""
    return tuple(f"arm_{side}_{i}_joint" for i in range(1, 8))


def group_joints(side: Side) -> tuple[str, ...]:
    """Return the joints of torso and arm: the order of every joint vector (8,) of a planning group."""
    return (TORSO_JOINT, *arm_joints(side))


def finger_joints(side: Side) -> tuple[str, str]:
    """Return the two finger joints in the order of the gripper controller."""
    return (f"gripper_{side}_right_finger_joint", f"gripper_{side}_left_finger_joint")
