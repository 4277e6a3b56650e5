# SPDX-License-Identifier: Apache-2.0
"""What counts as right, and what a share of right takes is worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from uncom_common.primitive import Primitive
from uncom_perception.types import Box, Detection, Geometry
from uncom_reasoner.types import GroundedCommand, GroundedTarget, Status, TargetKind
from uncom_sim.bench_understanding.judging.statistics import quantile, wilson
from uncom_sim.bench_understanding.judging.verdict import judge, place_fits
from uncom_sim.bench_understanding.takes.types import Conditions, TakePlan
from uncom_sim.objects.catalogue import model
from uncom_sim.types import Meaning, ObjectState, Scene, SceneObject, Table

LEMON = SceneObject("object", "lemon", "yellow", 0.58, -0.2)
BOWL = SceneObject("target", "bowl", "green", 0.62, 0.15)
MUG = SceneObject("clutter_1", "mug", "blue", 0.75, 0.35)


def state(thing):
    shape = model(thing.kind, thing.colour)
    pose = np.eye(4)
    pose[:3, 3] = (thing.x, thing.y, Table().height - shape.bounds[0, 2])
    return ObjectState(thing.id, thing.kind, thing.colour, pose, shape.size)


STATES = tuple(state(thing) for thing in (LEMON, BOWL, MUG))


def plan(meaning):
    scene = Scene(objects=(LEMON, BOWL, MUG), say="put the lemon in the bowl", meaning=meaning)
    return TakePlan(1, 0, 0, scene, (Primitive.PUT_IN, Primitive.PUT_ON, Primitive.PLACE), Conditions(), 1)


def seen(x, y):
    pose = np.eye(4)
    pose[:3, 3] = (x, y, 0.75)
    geometry = Geometry(pose[:3, 3].copy(), pose, np.full(3, 0.06), np.zeros((0, 3), np.float32))
    return Detection("thing_1", "lemon", 1.0, Box(0, 0, 1, 1), np.zeros((2, 2), bool), geometry)


def grounded(thing=(0.58, -0.2), target=(0.62, 0.15), place=None, primitive=Primitive.PUT_IN, relation="in"):
    if place is not None:
        pose = np.eye(4)
        pose[:3, 3] = (*place, 0.72)
        goal = GroundedTarget(TargetKind.AREA, None, pose)
    else:
        goal = GroundedTarget(TargetKind.OBJECT, seen(*target))
    return GroundedCommand(
        0.0,
        "base_footprint",
        "u",
        0,
        Status.GROUNDED,
        primitive=primitive,
        relation=relation,
        object=seen(*thing),
        target=goal,
    )


IN_BOWL = plan(Meaning("object", "in", "target"))


def test_object_action_and_target_as_meant_are_right():
    assert judge(IN_BOWL, STATES, grounded()).right


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (grounded(thing=(0.75, 0.35)), "took clutter_1"),
        (grounded(thing=(0.5, 0.0)), "took nothing"),
        (grounded(target=(0.75, 0.35)), "chose clutter_1"),
        (grounded(primitive=Primitive.POUR), "would pour it"),
        (grounded(relation="on"), "understood 'on'"),
        (grounded(place=(0.62, 0.0), relation="next_to"), "a place on the table"),
    ],
)
def test_any_other_part_is_wrong_and_says_why(command, why):
    verdict = judge(IN_BOWL, STATES, command)
    assert not verdict.right
    assert why in verdict.why


def test_a_question_or_nothing_at_all_is_not_right():
    asked = replace(grounded(), status=Status.AMBIGUOUS, reason="which one?")
    assert not judge(IN_BOWL, STATES, asked).right
    assert not judge(IN_BOWL, STATES, None).right


@pytest.mark.parametrize(
    ("relation", "place", "fits"),
    [
        ("left_of", (0.62, 0.33), True),
        ("left_of", (0.62, -0.02), False),
        ("left_of", (0.62, 0.20), False),  # in the bowl itself
        ("right_of", (0.60, -0.02), True),
        ("in_front_of", (0.49, 0.15), True),
        ("behind", (0.80, 0.16), True),
        ("next_to", (0.62, 0.0), True),
        ("next_to", (0.50, -0.4), False),
        ("left_of", (0.62, 0.60), False),  # beside the table
    ],
)
def test_a_place_must_lie_in_the_region_that_is_meant_and_be_free(relation, place, fits):
    assert place_fits(Meaning("object", relation, "target"), STATES, place, Table())[0] is fits


def test_here_is_near_the_place_pointed_at():
    meaning = Meaning("object", "area", None, (0.6, -0.05))
    assert place_fits(meaning, STATES, (0.6, -0.10), Table())[0]
    assert not place_fits(meaning, STATES, (0.6, -0.18), Table())[0]


def test_the_things_own_place_is_free_for_it():
    meaning = Meaning("object", "area", None, (0.58, -0.2))
    assert place_fits(meaning, STATES, (0.58, -0.2), Table())[0]


def test_wilsons_interval_of_the_papers_figure():
    low, high = wilson(131, 159)
    assert (round(low, 3), round(high, 3)) == (0.757, 0.875)
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(10, 10)[1] == pytest.approx(1.0)


def test_quantiles_are_values_that_were_measured():
    assert quantile([3.0, 1.0, 2.0], 0.95) == 3.0
    assert quantile([], 0.5) == 0.0
