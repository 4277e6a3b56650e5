# SPDX-License-Identifier: Apache-2.0
"""The motion of the fingers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from uncom_tiago_exec.robot.gripper_joints import finger_gap, finger_motion
from uncom_tiago_exec.robot.joint_names import finger_joints
from uncom_tiago_exec.robot.options import GRIPPER

PLACES = st.floats(0.0, GRIPPER.reach_m)


@given(PLACES, PLACES, st.floats(-0.1, 0.3))
def test_fingers_end_at_the_gap_within_their_reach_and_at_their_pace(first, second, gap):
    joints = finger_joints("left")
    start = np.array([first, second])
    motion = finger_motion("left", gap, dict(zip(joints, start, strict=True)))
    end = dict(zip(motion.joint_names, motion.positions[-1].tolist(), strict=True))
    wanted = min(max(gap, 0.0), 2 * GRIPPER.reach_m)
    if 0.0 < gap < start.sum():  # pressing: each finger by half, and none beyond its end
        assert wanted - 1e-9 <= finger_gap("left", end) <= start.sum()
    else:
        assert finger_gap("left", end) == pytest.approx(wanted)
    assert np.abs(motion.positions[-1] - start).max() <= GRIPPER.speed_m_s * motion.duration_s + 1e-9
    assert not motion.velocities[-1].any()


@given(PLACES, PLACES, st.floats(0.001, 0.03))
def test_fingers_that_close_on_what_moved_aside_both_go_on_and_open_ones_end_in_the_middle(first, second, closer):
    joints = finger_joints("right")
    start = np.array([first, second])
    positions = dict(zip(joints, start, strict=True))
    end = finger_motion("right", float(start.sum()) - closer, positions).positions[-1]
    assert (end <= start + 1e-9).all()
    opened = finger_motion("right", 2 * GRIPPER.reach_m - 1e-6, positions).positions[-1]
    assert opened[0] == pytest.approx(opened[1])
