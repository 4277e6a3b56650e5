# SPDX-License-Identifier: Apache-2.0
"""Pairs are left out of the checks only where no joints could bring them together."""

import numpy as np
import pytest
from exec_fixtures import robot, start_positions
from uncom_sim.bench_planning.scenes import tabletop_solids
from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.robot.reach_bounds import ReachBounds
from uncom_tiago_exec.types import SIDES


@pytest.mark.parametrize("side", SIDES)
def test_verdicts_are_the_same_when_every_pair_is_looked_at(side, monkeypatch):
    rng = np.random.default_rng(12)
    group, solids = robot().group(side, start_positions()), tabletop_solids(rng, 12)
    quick = CollisionChecker(group, solids)

    def every_pair(bounds, obstacles, _):
        return np.ones((len(bounds.radius), len(obstacles)), dtype=bool)

    monkeypatch.setattr(ReachBounds, "pairs_in_reach", every_pair)
    exact = CollisionChecker(group, solids)
    states = rng.uniform(group.lower, group.upper, (1500, 8))
    verdicts = [quick.is_free(q) for q in states]
    assert verdicts == [exact.is_free(q) for q in states]
    assert 100 < sum(verdicts) < 1400


def test_what_is_far_away_is_left_out_and_what_is_near_is_not():
    group = robot().group("left", start_positions())
    table, *things = tabletop_solids(np.random.default_rng(1), 6)
    near = group.bounds.pairs_in_reach((table, *things), 0.01)
    hand = group.links.index("gripper_left_link")
    assert near[hand, 0]
    assert near[hand].mean() > 0.5
    assert not near[group.links.index("head_2_link")].any()
