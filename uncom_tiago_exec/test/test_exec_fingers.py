# SPDX-License-Identifier: Apache-2.0
"""The motion of the fingers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from uncom_tiago_exec.fingers import REACH, SPEED, finger_gap, finger_motion
from uncom_tiago_exec.robot_model import finger_joints

PLACES = st.floats(0.0, REACH)


@given(PLACES, PLACES, st.floats(-0.1, 0.3))
def test_fingers_end_at_the_gap_within_their_reach_and_at_their_pace(first, second, gap):
    joints = finger_joints("left")
    start = np.array([first, second])
    motion = finger_motion("left", gap, dict(zip(joints, start, strict=True)))
    end = dict(zip(motion.joint_names, motion.positions[-1].tolist(), strict=True))
    assert finger_gap("left", end) == pytest.approx(min(max(gap, 0.0), 2 * REACH))
    assert np.abs(motion.positions[-1] - start).max() <= SPEED * motion.duration_s + 1e-9
    assert not motion.velocities[-1].any()
