# SPDX-License-Identifier: Apache-2.0
"""The benchmark's takes as planned: the paper's design, decidable, and from one seed."""

from __future__ import annotations

from itertools import combinations

import pytest
from uncom_sim.bench_understanding.takes.scenarios import scenario, scenarios
from uncom_sim.bench_understanding.takes.take_planning import plan_take, plan_takes
from uncom_sim.bench_understanding.takes.types import SUBJECTS
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.footprint import outline
from uncom_sim.person.phrases import find_phrases
from uncom_sim.world.scene_variation import all_visible

AUTHORS = (11, 9, 7, 7, 6, 7, 1, 7, 10, 9, 6, 6, 7, 6, 10, 5, 8, 8, 5, 10, 8, 6)


@pytest.fixture(scope="module")
def plans():
    return plan_takes(4)


def test_scenarios_have_as_many_takes_as_the_authors():
    assert tuple(one.takes for one in scenarios()) == AUTHORS
    assert sum(AUTHORS) == 159


def test_scenarios_cover_the_table_of_variations_and_its_example_rows():
    seen = {name: {one.subjects()[name] for one in scenarios()} for name in SUBJECTS}
    assert seen["object"] == {"reference", "deixis"}
    assert seen["target"] == {"reference", "deixis", "absolute area", "relative area"}
    assert all(seen[name] == {"yes", "no"} for name in ("object_distractors", "target_distractors", "clutter"))
    assert {one.row for one in scenarios()} - {None} == set(range(1, 12))


def test_a_scenario_that_is_not_there_is_refused():
    with pytest.raises(SceneError, match="1 to 22"):
        scenario(23)


def test_the_first_take_says_the_papers_words(plans):
    first = {plan.scenario: plan.scene.say for plan in plans if plan.index == 0}
    assert first[1] == "take the mug and put it on this plate"
    assert first[6] == "take this thing and put it on this thing"
    assert first[9] == "take this plate and stack it on top of the other plate"
    assert first[10] == "take the banana and put it inside of the frying pan"
    assert first[12] == "pour the cereal into the bowl"


def test_a_plan_depends_on_scenario_number_and_seed_alone(plans):
    again = plan_take(scenario(18), 3, 4)
    assert again in plans
    assert again.key("v") == next(p for p in plans if p.name == again.name).key("v")
    assert again.key("v") != again.key("w")
    assert plan_take(scenario(18), 3, 5).scene != again.scene


def test_takes_differ_in_words_voice_hand_and_manner(plans):
    people = [plan.scene.person for plan in plans]
    assert len({plan.scene.say for plan in plans}) > 100
    assert len({p.voice for p in people}) >= 6
    assert {p.hand for p in people} == {"left", "right"}
    assert {plan.manner for plan in plans} == {"plain", "early", "late", "wavering"}
    assert min(p.skin for p in people) < 0.1
    assert max(p.skin for p in people) > 0.9


def test_fewer_takes_are_spread_over_the_scenarios():
    few = plan_takes(0, takes=22)
    assert {plan.scenario for plan in few} == set(range(1, 23))
    assert [plan.scenario for plan in plan_takes(0, (3, 5), takes=4)] == [3, 3, 5, 5]


def test_everything_is_in_sight_and_apart(plans):
    for plan in plans:
        assert all_visible(plan.scene), plan.name
        shapes = [outline(thing) for thing in plan.scene.objects]
        assert all(a.distance(b) > 0.04 for a, b in combinations(shapes, 2)), plan.name


def test_what_is_pointed_at_is_spoken_of(plans):
    """The person's hand moves with the words, so that both phrases have to be found in every sentence."""
    for plan in plans:
        spans = find_phrases(plan.scene.say.split())
        assert spans.object is not None, plan.scene.say
        assert spans.target is not None, plan.scene.say
        assert spans.object[1] <= spans.target[0], plan.scene.say


def test_no_sentence_without_pointing_needs_it(plans):
    """Where nobody points, kind and colour tell the meant things from all others."""
    for plan in plans:
        if plan.scene.point_object is not None:
            continue
        by_id = {thing.id: thing for thing in plan.scene.objects}
        for name in ("object", "target"):
            own = by_id[name]
            same = [t for t in plan.scene.objects if (t.kind, t.colour) == (own.kind, own.colour)]
            named = own.colour in plan.scene.say or sum(t.kind == own.kind for t in plan.scene.objects) == 1
            assert len(same) == 1, plan.name
            assert named, plan.name


def test_the_other_plate_is_the_only_other_one(plans):
    for plan in plans:
        if "other" in plan.scene.say:
            kinds = [thing.kind for thing in plan.scene.objects]
            assert kinds.count(plan.scene.object("target").kind) == 2, plan.name


def test_a_place_that_is_meant_is_free(plans):
    for plan in plans:
        area = plan.meaning.area
        if area is not None:
            assert plan.scene.table.contains(*area, margin=0.04)
            away = [outline(t).distance(_point(area)) for t in plan.scene.objects]
            assert min(away) >= 0.10, plan.name


def _point(place):
    import shapely  # noqa: PLC0415

    return shapely.Point(place)
