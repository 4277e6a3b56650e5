# SPDX-License-Identifier: Apache-2.0
"""Closed-form postures are exact, and the posture a pose was made from is among them."""

import numpy as np
import pytest
from exec_fixtures import robot, start_positions
from uncom_tiago_exec.kinematics.analytic_ik import AnalyticIk
from uncom_tiago_exec.types import SIDES


@pytest.mark.parametrize("side", SIDES)
def test_every_posture_reaches_the_pose_and_the_one_it_came_from_is_there(side):
    group = robot().group(side, start_positions())
    solver = AnalyticIk(group.model, group.tool)
    rng = np.random.default_rng(7)
    for _ in range(40):
        q = rng.uniform(group.lower, group.upper)
        target = group.forward(q)
        found = solver.postures(target, q[:1], q[1:2])[:, :, 0].T
        found = found[np.isfinite(found).all(axis=1)]
        assert all(np.abs(group.forward(p) - target).max() < 1e-9 for p in found)
        turns = np.abs((found - q + np.pi) % (2.0 * np.pi) - np.pi).max(axis=1)
        assert turns.min() < 1e-8


def test_an_arm_of_other_build_is_not_taken_for_a_tiago():
    group = robot().group("left", start_positions())
    model = group.model.copy()
    model.jointPlacements[7].translation = np.array([0.02, 0.0, -0.15])
    with pytest.raises(ValueError, match="do not meet"):
        AnalyticIk(model, group.tool)
