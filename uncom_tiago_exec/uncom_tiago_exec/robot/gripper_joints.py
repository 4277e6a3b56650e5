# SPDX-License-Identifier: Apache-2.0
"""How the fingers of a gripper move: both alike, and no farther than they reach.

What is held may have moved to one side with both fingers. They then close further from where they are: a finger that
has come to where it was told presses no more.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uncom_tiago_exec.robot.joint_names import finger_joints
from uncom_tiago_exec.robot.options import GRIPPER, GripperOptions
from uncom_tiago_exec.types import Side, Trajectory


def finger_gap(side: Side, positions: Mapping[str, float]) -> float:
    """Return the gap between the fingers [m] at some joint positions."""
    return sum(positions[name] for name in finger_joints(side))


def finger_motion(
    side: Side, gap: float, positions: Mapping[str, float], *, options: GripperOptions = GRIPPER
) -> Trajectory:
    """Return the motion that brings the fingers from where they are to a gap [m]; it is one point, their goal.

    Opening, or closing wholly, they end in the middle; else each closes by half of what is left, as far as it can.
    """
    joints = finger_joints(side)
    start = np.array([positions[name] for name in joints])
    middle = np.full(2, gap / 2.0)
    pressing = 0.0 < gap < start.sum()
    end = np.clip(middle + start - start.mean() if pressing else middle, 0.0, options.reach_m)
    duration = max(options.least_duration_s, float(np.abs(end - start).max()) / options.speed_m_s)
    return Trajectory(joints, np.array([duration]), end[None], np.zeros((1, 2)))
