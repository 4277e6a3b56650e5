# SPDX-License-Identifier: Apache-2.0
"""Motions of the two fingers of a gripper: both travel the same distance, within their range.

A held object may have shifted to one side together with both fingers. Closing then starts from where the fingers are:
a finger that has reached its commanded position exerts no force any more.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uncom_tiago_exec.robot.joint_names import finger_joints
from uncom_tiago_exec.robot.options import GRIPPER, GripperOptions
from uncom_tiago_exec.types import Side, Trajectory


def finger_gap(side: Side, positions: Mapping[str, float]) -> float:
    """Return the gap between the fingers [m] at joint positions by name [m]."""
    return sum(positions[name] for name in finger_joints(side))


def finger_motion(
    side: Side, gap: float, positions: Mapping[str, float], *, options: GripperOptions = GRIPPER
) -> Trajectory:
    """Return the motion that brings the fingers from their positions to a gap; it has one point, the goal.

    When they open, or close completely, they end symmetrically about the middle; otherwise each closes by half of the
    difference of the gaps, within its range.

    Args:
        side: of the gripper.
        gap: between the fingers at the end [m].
        positions: joint positions by name [m].
        options: numbers that tune it.
    """
    joints = finger_joints(side)
    start = np.array([positions[name] for name in joints])
    middle = np.full(2, gap / 2.0)
    pressing = 0.0 < gap < start.sum()
    end = np.clip(middle + start - start.mean() if pressing else middle, 0.0, options.reach_m)
    duration = max(options.least_duration_s, float(np.abs(end - start).max()) / options.speed_m_s)
    return Trajectory(joints, np.array([duration]), end[None], np.zeros((1, 2)))
