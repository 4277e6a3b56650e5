# SPDX-License-Identifier: Apache-2.0
"""Things chosen by order, size, exclusion and likeness; several things at once; whose left and right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reasoner_scenes import TABLE_Z, Thing, command, evidence, pointing, reference
from shapely.geometry import Point
from uncom_common.primitive import Primitive
from uncom_language.types import Relation
from uncom_perception.types import Attribute
from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.grounding.ground import ground, ground_parts
from uncom_reasoner.grounding.phrasing import compose_sentence
from uncom_reasoner.types import Given, Status

# In a row from the robot's left (+y) to its right, not in the order of their ids; a lemon that must not be counted.
CUPS = [
    Thing("cup_c", "mug", 0.62, -0.2, colour="red"),
    Thing("cup_a", "mug", 0.6, 0.3, colour="red"),
    Thing("cup_d", "mug", 0.58, -0.38, colour="blue"),
    Thing("cup_b", "mug", 0.64, 0.05, colour="green"),
    Thing("lemon_1", "lemon", 0.6, 0.2),
]
ORDER = ["cup_a", "cup_b", "cup_c", "cup_d"]


def coloured(made, things=CUPS):
    """Give the detections the colours of their things, as the detector does."""
    by_id = {t.id: t.colour for t in things}
    seen = [
        replace(d, attributes=(Attribute("colour", by_id[d.id], 0.9),) if by_id[d.id] else ())
        for d in made.scene.detections
    ]
    return replace(made, scene=replace(made.scene, detections=tuple(seen)))


def chosen(obj, things=CUPS, hands=(), **kwargs):
    g = ground(coloured(evidence(command(obj), things, list(hands)), things), **kwargs).grounded
    return g.object.id if g.status is Status.GROUNDED else g.status


@pytest.mark.parametrize("ordinal", [1, 2, 3, 4, -1, -2])
@pytest.mark.parametrize("side", ["left", "right", ""])
def test_an_ordinal_counts_along_its_side_among_its_kind(ordinal, side):
    cup = reference("cup", 0, 1, head="mug", ordinal=ordinal, ordinal_side=side)
    order = ORDER[::-1] if side == "right" else ORDER
    assert chosen(cup) == order[ordinal - 1 if ordinal > 0 else ordinal]


def test_the_second_biggest_counts_along_the_size():
    things = [Thing("a", "plate", 0.6, 0.3), Thing("b", "bowl", 0.6, 0.0), Thing("c", "mug", 0.6, -0.3)]
    which = reference("one", 0, 1, head="one", modifiers=("biggest",), ordinal=2, concrete=False)
    volumes = sorted(("a", "b", "c"), key={"a": 0.22 * 0.22 * 0.02, "b": 0.16**2 * 0.07, "c": 0.08**2 * 0.09}.get)
    assert chosen(which, things) == volumes[-2]


def test_one_that_was_excluded_is_not_taken():
    """ "The mug that is not red": with one green, one blue and two red ones, and then only one that is not red."""
    not_red = reference("mug", 0, 1, excluded_modifiers=("red",))
    assert chosen(not_red) is Status.AMBIGUOUS
    assert chosen(not_red, [t for t in CUPS if t.id != "cup_d"]) == "cup_b"


def test_the_same_colour_as_this_is_the_other_one_of_that_colour():
    """R13: the finger marks what is compared with, and does not pick the answer."""
    hands = pointing((0.62, -0.2, TABLE_Z + 0.04), (0.8, -0.1, 0.95), np.arange(0.8, 1.6, 0.1))
    this = reference("this", 1.0, 1.3, concrete=False, deictic="this")
    one = reference("mug", 0.2, 1.3, comparison="same_colour", compared_to=this)
    assert chosen(one, hands=hands) == "cup_a"
    other = replace(one, comparison="other_colour")
    assert chosen(other, [t for t in CUPS if t.id != "cup_d"], hands) == "cup_b"


@pytest.mark.parametrize(("how", "wanted"), [("bigger", "plate_1"), ("smaller", "lemon_1")])
def test_a_thing_is_bigger_or_smaller_than_another(how, wanted):
    things = [Thing("plate_1", "plate", 0.6, 0.3), Thing("mug_1", "mug", 0.6, 0), Thing("lemon_1", "lemon", 0.6, -0.3)]
    things[0] = replace(things[0], kind="bowl", id="plate_1")
    one = reference("thing", 0, 1, concrete=False, comparison=how, compared_to=reference("mug", 0.6, 1))
    assert chosen(one, things) == wanted


def test_the_one_nearest_to_another_is_nearest_among_its_kind():
    things = [*CUPS[:4], Thing("box_1", "box", 0.6, 0.15), Thing("lemon_2", "lemon", 0.72, 0.16)]
    one = reference("mug", 0, 1, comparison="nearest", compared_to=reference("box", 0.6, 1))
    assert chosen(one, things) == "cup_b"


def test_what_cannot_be_seen_is_not_compared():
    one = reference("mug", 0, 1, comparison="same_material", compared_to=reference("lemon", 0.6, 1))
    g = ground(evidence(command(one), CUPS)).grounded
    assert (g.status, g.reason) == (Status.FAILED, "I cannot tell by looking which things have the same material.")


def test_a_thing_between_two_others_is_found():
    second = reference("lemon", 1, 1.5)
    first = reference("box", 0.5, 1, anchor_relation="and", anchor=second)
    things = [*CUPS[:4], Thing("box_1", "box", 0.63, -0.1), Thing("lemon_1", "lemon", 0.6, -0.3)]
    assert chosen(reference("mug", 0, 1.5, anchor_relation="between", anchor=first), things) == "cup_c"


# --- several things -----------------------------------------------------------------------------------------

TWO = [
    Thing("apple_1", "apple", 0.6, 0.3),
    Thing("apple_2", "apple", 0.55, 0.05),
    Thing("bowl_1", "bowl", 0.7, -0.25),
    Thing("lemon_1", "lemon", 0.8, 0.1),
]


def several(text, quantity, things, text_said="", **kwargs):
    obj = reference(text, 0, 1, head=text.removesuffix("s"), quantity=quantity)
    return ground_parts(evidence(command(obj, text=text_said, **kwargs), things))


@pytest.mark.parametrize("quantity", [2, 0])
def test_both_apples_go_one_after_the_other_into_the_bowl(quantity):
    parts = several("apple", quantity, TWO, target=reference("bowl", 1, 2))
    assert {d.grounded.object.id for d in parts} == {"apple_1", "apple_2"}
    assert {d.grounded.target.detection.id for d in parts} == {"bowl_1"}
    assert [(d.grounded.part, d.grounded.parts) for d in parts] == [(0, 2), (1, 2)]
    cmd = command(reference("apples", 0, 1, head="apple", quantity=quantity), reference("bowl", 1, 2))
    assert compose_sentence(cmd, parts[0].grounded) == "I take the apples and put them in the bowl."


def test_things_of_a_group_do_not_get_the_same_place():
    box = Thing("box_1", "box", 0.6, -0.1)
    parts = several(
        "apple",
        2,
        [*TWO[:2], box],
        target=reference("box", 1, 2),
        relation=Relation.RIGHT_OF,
        primitive=Primitive.PLACE,
    )
    assert [d.grounded.status for d in parts] == [Status.GROUNDED] * 2
    a, b = (Point(*d.grounded.target.pose[:2, 3]) for d in parts)
    assert a.distance(b) > 0.07


def test_three_where_two_were_asked_for_is_ambiguous_unless_any_will_do():
    three = [*TWO, Thing("apple_3", "apple", 0.6, -0.45)]
    (decision,) = several("apple", 2, three, "take the two apple")
    assert decision.grounded.status is Status.AMBIGUOUS
    assert set(decision.doubt.choices) == {"apple_1", "apple_2", "apple_3"}
    assert len(several("apple", 2, three, "take two apple")) == 2


def test_fewer_than_were_asked_for_is_said():
    (decision,) = several("apple", 3, TWO)
    assert decision.grounded.reason == "I see only two of the apples."


def test_plates_are_stacked_on_the_largest():
    plates = [Thing("plate_1", "plate", 0.6, 0.3), Thing("bowl_1", "bowl", 0.6, 0.0), Thing("mug_1", "mug", 0.6, -0.3)]
    parts = several("thing", 0, plates, primitive=Primitive.STACK)
    assert parts[0].grounded.status is Status.FAILED  # no kind and no gesture
    plates = [replace(t, kind="plate" if t.id != "mug_1" else "mug") for t in plates]
    (part,) = several("plate", 0, plates, primitive=Primitive.STACK)
    assert {part.grounded.object.id, part.grounded.target.detection.id} == {"plate_1", "bowl_1"}


# --- whose left -------------------------------------------------------------------------------------------------

ROW = [Thing("mug_l", "mug", 0.6, 0.25), Thing("mug_r", "mug", 0.6, -0.25), Thing("box_1", "box", 0.62, 0.0)]


def left(things=ROW, **kwargs):
    return ground(evidence(command(reference("left mug", 0, 1)), things), placing=PlacingConfig(**kwargs))


def test_left_is_the_robots_unless_set_otherwise_and_the_other_reading_is_told():
    decision = left()
    assert decision.grounded.object.id == "mug_l"
    assert decision.perspective == "robot"
    assert "mug_r" in decision.refused[0]
    assert left(perspective="speaker").grounded.object.id == "mug_r"


def test_sides_that_are_as_likely_are_asked_about_only_if_it_matters():
    decision = left(perspective_prior=0.5)
    assert (decision.grounded.status, decision.doubt.part) == (Status.AMBIGUOUS, "perspective")
    assert decision.grounded.reason == "Do you mean as I see it or as you see it?"
    alone = left([ROW[0], ROW[2]], perspective_prior=0.5)
    assert alone.grounded.object.id == "mug_l"


def test_an_answered_side_is_taken():
    made = evidence(command(reference("left mug", 0, 1)), ROW)
    decision = ground(replace(made, given=Given(perspective="speaker")), placing=PlacingConfig(perspective_prior=0.5))
    assert decision.grounded.object.id == "mug_r"


def test_an_answer_settles_a_part_and_is_a_factor_like_the_others():
    made = evidence(command(reference("mug", 0, 1)), ROW)
    assert ground(made).grounded.status is Status.AMBIGUOUS
    g = ground(replace(made, given=Given(among={"object": frozenset(("mug_r",))}))).grounded
    assert g.object.id == "mug_r"
    assert g.object_probability > 0.99
    assert {f.name for f in g.object_candidates[1].factors} >= {"answer"}
    g = ground(replace(made, given=Given(excluded={"object": frozenset(("mug_r",))}))).grounded
    assert g.object.id == "mug_l"
