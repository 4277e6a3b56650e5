# SPDX-License-Identifier: Apache-2.0
"""The commands of the execution benchmark can be done as they are built."""

import pytest
import shapely
from uncom_sim.bench_execution import summary
from uncom_sim.bench_execution_cases import make_case
from uncom_sim.objects.catalogue import KINDS
from uncom_sim.objects.footprint import outline
from uncom_sim.variation import everything_in_sight


@pytest.mark.parametrize("number", [1, 4, 8, 14, 19, 25])
def test_a_case_is_seen_whole_and_its_place_is_free(number):
    case = make_case(number, seed=2)
    assert case.kind == KINDS[number % len(KINDS)]
    assert everything_in_sight(case.scene)
    if case.place is not None:
        others = [outline(o) for o in case.scene.objects if o.id != case.meaning.object]
        assert all(shape.distance(shapely.Point(case.place)) > 0.02 for shape in others)


def test_the_same_number_and_seed_give_the_same_case():
    assert make_case(3, 5) == make_case(3, 5)
    assert make_case(3, 5) != make_case(3, 6)


def test_totals_count_what_was_moved_and_touched():
    base = {"kind": "can", "relation": "in", "arm": "left", "planning_s": [0.4]}
    runs = [
        {**base, "success": True, "others_moved_m": 0.001, "table_touches": 0},
        {**base, "success": False, "others_moved_m": 0.03, "table_touches": 2},
    ]
    total = summary(runs)
    assert (total["runs"], total["succeeded"], total["table_contacts"]) == (2, 1, 2)
    assert total["bystander_moved_share"] == 0.5
    assert total["by_kind"] == {"can": "1/2"}
