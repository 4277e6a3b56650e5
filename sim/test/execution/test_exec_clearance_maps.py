# SPDX-License-Identifier: Apache-2.0
"""A map of distances may stand for a check only where the check would say the same."""

import numpy as np
import pytest
from exec_fixtures import robot, start_positions
from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.collision.options import Margins
from uncom_tiago_exec.types import SIDES


@pytest.mark.parametrize("side", SIDES)
def test_verdicts_are_the_same_with_and_without_the_map(side):
    """Near the tucked arm and anywhere: free is free and touching is touching."""
    mapped, plain = robot().group(side, start_positions()), robot().group(side, start_positions())
    assert mapped.clearance_maps
    plain.clearance_maps = {}
    quick, exact = CollisionChecker(mapped), CollisionChecker(plain)
    rng = np.random.default_rng(8)
    tuck = mapped.vector(start_positions())
    near = np.clip(tuck + rng.normal(scale=0.4, size=(300, 8)), mapped.lower, mapped.upper)
    states = [*near, *rng.uniform(mapped.lower, mapped.upper, (500, 8))]
    verdicts = [quick.is_free(q) for q in states]
    assert verdicts == [exact.is_free(q) for q in states]
    assert 50 < sum(verdicts) < len(states) - 50
    for q, free in zip(states[:100], verdicts, strict=False):
        assert free == (not quick.touching(q))


@pytest.mark.parametrize("side", SIDES)
def test_the_map_never_promises_more_room_than_there_is(side):
    """With a margin as large as what the map says is left, nothing touches."""
    group = robot().group(side, start_positions())
    rng = np.random.default_rng(9)
    plain = robot().group(side, start_positions())
    for pair, clearance in group.clearance_maps.items():
        plain.clearance_maps, plain.body_pairs = {}, (pair,)
        for q in rng.uniform(group.lower, group.upper, (40, 8)):
            promised = clearance.clearance_at(q)
            if promised > 0.0:
                assert CollisionChecker(plain, margins=Margins(body=promised)).is_free(q)
