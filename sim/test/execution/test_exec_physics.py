# SPDX-License-Identifier: Apache-2.0
"""Commands carried out by physics: what is taken is held by friction, and nothing else moves."""

import pytest
from exec_fixtures import robot
from uncom_common.primitive import Primitive
from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.run import run_case
from uncom_sim.types import Meaning
from uncom_sim.world.scene_file import scene_from_dict

pytestmark = pytest.mark.slow


def scene(*things):
    """Return a scene of (kind, x, y, yaw)."""
    objects = [{"id": f"o{i}", "kind": kind, "x": x, "y": y, "yaw": yaw} for i, (kind, x, y, yaw) in enumerate(things)]
    return scene_from_dict({"objects": objects, "say": "take it"})


def check(case):
    run = run_case(case, robot=robot())
    assert run.outcome.success, run.outcome.reason
    assert run.physical.success, run.physical.reason
    assert run.physical.others_moved_m < 0.02
    assert run.table_touches == 0
    assert run.home_error < 0.02


@pytest.mark.timeout(600)
def test_a_lemon_ends_in_a_bowl_across_the_middle():
    things = scene(("lemon", 0.58, 0.18, 0.6), ("bowl", 0.62, -0.1, 0.0), ("can", 0.75, 0.2, 0.0))
    check(Case(0, things, Meaning("o0", "in", "o1"), "in", Primitive.PUT_IN, None))


@pytest.mark.timeout(600)
def test_a_mug_ends_on_a_free_place():
    things, place = scene(("mug", 0.6, -0.15, 2.0), ("apple", 0.62, 0.2, 0.0)), (0.6, -0.35)
    check(Case(0, things, Meaning("o0", "area", None, place), "area", Primitive.PLACE, place))
