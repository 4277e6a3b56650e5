# SPDX-License-Identifier: Apache-2.0
"""The commands of the execution benchmark can be done as they are built."""

import pytest
import shapely
from uncom_sim.bench_execution.cases import RELATIONS, asked_relations, initial_states, make_case
from uncom_sim.bench_execution.run import CaseTask, run_numbered_case, summary
from uncom_sim.objects.catalogue import KINDS
from uncom_sim.objects.footprint import outline
from uncom_sim.scoring.end_state import judge
from uncom_sim.world.scene_variation import all_visible


@pytest.mark.parametrize("number", [1, 4, 8, 14, 19, 25])
def test_a_case_is_seen_whole_and_its_place_is_free(number):
    case = make_case(number, seed=2)
    assert case.kind == KINDS[number % len(KINDS)]
    assert all_visible(case.scene)
    if case.place is not None:
        others = [outline(o) for o in case.scene.objects if o.id != case.meaning.object]
        assert all(shape.distance(shapely.Point(case.place)) > 0.02 for shape in others)


def test_the_same_number_and_seed_give_the_same_case():
    assert make_case(3, 5) == make_case(3, 5)
    assert make_case(3, 5) != make_case(3, 6)


def test_everything_is_asked_for_and_most_commands_bring_something_somewhere():
    asked = [asked_relations(number)[0] for number in range(60)]
    assert set(asked) == set(RELATIONS)
    assert sum(relation in ("push", "give", "pour", "point") for relation in asked) <= 15


@pytest.mark.parametrize("number", [4, 6, 18, 32])
def test_what_is_asked_for_is_not_so_already(number):
    case = make_case(number, seed=3)
    states = initial_states(case.scene)
    assert not judge(states, states, case.meaning, case.scene.table).success


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


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_case_goes_the_same_whatever_its_process_has_run_before():
    first = run_numbered_case(CaseTask(5, 3160))
    run_numbered_case(CaseTask(1, 3160))
    again = run_numbered_case(CaseTask(5, 3160))
    for name in ("motion_s", "forces_n", "said", "simulated_s", "grasp"):
        assert again[name] == first[name]
