# SPDX-License-Identifier: Apache-2.0
"""Which thing is chosen, from words, gestures and the scene."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reasoner_scenes import (
    POSE,
    TABLE_Z,
    VIEW,
    Thing,
    command,
    evidence,
    pointing,
    reference,
)
from uncom_common.primitive import Primitive
from uncom_language.types import Relation, Span
from uncom_reasoner.detector_phrases import detector_phrase, leaves_choice_open, phrases_for
from uncom_reasoner.grounding.ground import ground
from uncom_reasoner.pointing.ray_fusion import assign_dwells, observe_rays, segment_dwells
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory
from uncom_reasoner.types import Status, View
from uncom_reasoner.weights import load_weights

LEMONS = [
    Thing("lemon_1", "lemon", 0.6, 0.1),
    Thing("lemon_2", "lemon", 0.65, 0.32),
    Thing("bowl_1", "bowl", 0.7, -0.2, colour="red"),
    Thing("bowl_2", "bowl", 0.6, -0.38, colour="blue"),
]
TIMES = np.arange(0.2, 1.2, 0.1)


def at(thing: Thing, tip=(0.8, 0.1, 0.9), times=TIMES, **kwargs):
    return pointing((thing.x, thing.y, TABLE_Z + 0.03), tip, times, **kwargs)


def this(text: str, start=0.4, end=0.9, **kwargs):
    bare = text.rsplit(maxsplit=1)[-1] in ("this", "thing")
    return reference(text, start, end, deictic="this", concrete=not bare, **kwargs)


def test_a_named_thing_is_found_without_any_gesture():
    g = ground(evidence(command(reference("lemon", 0, 1), reference("red bowl", 1, 2)), LEMONS[1:])).grounded
    assert (g.status, g.object.id, g.target.detection.id) == (Status.GROUNDED, "lemon_2", "bowl_1")


def test_two_alike_and_no_gesture_is_said_and_not_guessed():
    g = ground(evidence(command(reference("lemon", 0, 1)), LEMONS)).grounded
    assert g.status is Status.AMBIGUOUS
    assert g.reason == "I could not tell which lemon you mean: there are two."


def test_any_of_two_alike_will_do_if_the_speaker_says_so():
    cmd = command(reference("lemon", 0, 1), text="take a lemon")
    assert leaves_choice_open(cmd.object, cmd)
    assert ground(evidence(cmd, LEMONS)).grounded.status is Status.GROUNDED
    assert not leaves_choice_open(cmd.object, command(reference("lemon", 0, 1), text="take the lemon"))


def test_what_is_not_there_is_not_replaced_by_something_else():
    g = ground(evidence(command(reference("apple", 0, 1)), LEMONS)).grounded
    assert (g.status, g.object, g.reason) == (Status.FAILED, None, "I do not see the apple on the table.")


@pytest.mark.parametrize("metric", [True, False])
@pytest.mark.parametrize("wanted", [0, 1])
def test_a_gesture_chooses_among_things_that_are_alike(wanted, metric):
    hands = at(LEMONS[wanted], noise=0.04, rng=np.random.default_rng(wanted), metric=metric)
    g = ground(evidence(command(reference("lemon", 0.4, 0.9)), LEMONS, hands)).grounded
    assert g.object.id == LEMONS[wanted].id


@settings(max_examples=25, deadline=None)
@given(angle=st.floats(0.0, 2 * np.pi), metric=st.booleans())
def test_a_thing_behind_the_hand_never_beats_the_one_in_front(angle, metric):
    """M7: the ray goes forward only, whatever way it points and however near its backward line a thing lies."""
    d = np.array([np.cos(angle), np.sin(angle)])
    middle = np.array([0.7, 0.0])
    front, back = middle + 0.2 * d, middle - 0.12 * d
    things = [Thing("lemon_1", "lemon", *back), Thing("lemon_2", "lemon", *front)]
    hands = at(things[1], tip=(*middle, TABLE_Z + 0.08), metric=metric)
    g = ground(evidence(command(this("this")), things, hands)).grounded
    assert g.object is not None
    assert g.object.id == "lemon_2"


@pytest.mark.parametrize("metric", [True, False])
@pytest.mark.parametrize("wanted", [0, 1, 2])
def test_a_finger_along_an_image_axis_chooses_what_it_points_at(wanted, metric):
    """M6: a vertical finger has no slope, and must not fall back on the first thing."""
    things = [Thing(f"lemon_{i}", "lemon", 0.6, y) for i, y in enumerate((-0.25, 0.0, 0.25))]
    hands = at(things[wanted], tip=(0.85, things[wanted].y, 0.85), metric=metric)
    assert abs(hands[0].hands[0].ray.direction[0]) < 0.25
    g = ground(evidence(command(this("this thing")), things, hands)).grounded
    assert g.object.id == things[wanted].id


def test_the_outline_counts_and_not_the_middle():
    """M8: a finger at the rim of a plate means the plate, though a lemon's middle is nearer to the line."""
    things = [Thing("plate_1", "plate", 0.65, 0.0), Thing("lemon_1", "lemon", 0.65, -0.2)]
    hands = pointing((0.65, -0.095, 0.735), (0.85, -0.08, 0.85), TIMES)
    assert ground(evidence(command(this("this")), things, hands)).grounded.object.id == "plate_1"


def test_object_and_target_have_their_own_gestures():
    hands = at(LEMONS[1]) + at(LEMONS[3], tip=(0.8, -0.4, 0.9), times=np.arange(1.8, 2.6, 0.1))
    g = ground(evidence(command(this("lemon"), this("bowl", 1.9, 2.3)), LEMONS, hands)).grounded
    assert (g.object.id, g.target.detection.id) == ("lemon_2", "bowl_2")


def test_the_thing_that_is_moved_is_never_its_own_target():
    things = [Thing("plate_1", "plate", 0.6, 0.1), Thing("plate_2", "plate", 0.65, -0.3)]
    target = reference("plate", 1.9, 2.3, other=True)
    cmd = command(this("plate"), target, primitive=Primitive.STACK, relation=Relation.ON)
    g = ground(evidence(cmd, things, at(things[0]))).grounded
    assert (g.object.id, g.target.detection.id) == ("plate_1", "plate_2")


def test_a_hand_that_passes_by_weighs_less_than_one_that_stays():
    """The slowed hand counts: the hand sweeps over lemon 2 while the words are spoken and then stays on lemon 1."""
    rng = np.random.default_rng(1)
    sweep = [
        at(LEMONS[1], tip=(0.85, 0.3 - 0.1 * i, 0.9), times=np.array([0.3 + 0.1 * i]), rng=rng)[0] for i in range(3)
    ]
    stay = at(LEMONS[0], times=np.arange(0.6, 1.2, 0.1))
    g = ground(evidence(command(this("lemon", 0.3, 0.8)), LEMONS, sweep + stay)).grounded
    assert g.object.id == "lemon_1"


def test_a_late_or_early_gesture_still_belongs_to_its_word():
    weights = load_weights()
    for shift in (-0.4, 0.4):
        hands = at(LEMONS[0], times=np.arange(1.0, 1.5, 0.1) + shift)
        dwells = segment_dwells(observe_rays(hands, lambda _: POSE), weights)
        assert assign_dwells("object", Span(1.1, 1.4), dwells, weights).present
        assert not assign_dwells("object", Span(5.0, 5.5), dwells, weights).present


@pytest.mark.parametrize("step_m", [0.08, 0.12, 0.16])
def test_two_looks_that_a_slow_hand_joins_are_two(step_m):
    """Object and place lie close together, and the hand turns from one to the other without a jump."""
    weights = load_weights()
    begin, end = np.array([0.62, 0.12, TABLE_Z]), np.array([0.7, 0.12 - step_m, TABLE_Z])
    rng = np.random.default_rng(3)
    hands = []
    for stamp in np.arange(0.0, 2.0, 0.125):
        share = float(np.clip((stamp - 0.9) / 0.3, 0.0, 1.0))
        aim = (1 - share) * begin + share * end
        tip = begin + np.array([0.16, -0.03, 0.13]) + 0.3 * share * (end - begin)
        hands += pointing(tuple(aim), tuple(tip), np.array([stamp]), noise=0.02, rng=rng)
    dwells = segment_dwells(observe_rays(hands, lambda _: POSE), weights)
    first, second = Span(0.1, 0.6), Span(1.35, 1.8)
    rays = [
        assign_dwells("object", first, dwells, weights, (second,)),
        assign_dwells("target", second, dwells, weights, (first,)),
    ]
    for ray, aim in zip(rays, (begin, end), strict=True):
        space = max(ray.dwells, key=lambda entry: entry[1])[0].space
        there = space.tip + space.direction * (TABLE_Z - space.tip[2]) / space.direction[2]
        assert np.linalg.norm(there - aim) < 0.35 * step_m


@pytest.mark.parametrize("seed", range(5))
def test_a_wavering_hand_looks_at_one_thing(seed):
    rng = np.random.default_rng(seed)
    hands = []
    for stamp in np.arange(0.0, 1.5, 0.125):
        sway = 0.012 * np.sin(2 * np.pi * 1.1 * stamp + seed)
        hands += pointing((0.6, 0.1 + sway, TABLE_Z), (0.8, 0.1, 0.9), np.array([stamp]), noise=0.02, rng=rng)
    assert len(segment_dwells(observe_rays(hands, lambda _: POSE), load_weights())) == 1


def test_this_without_a_gesture_and_with_a_choice_is_asked_about():
    """M11: no gesture is no crash, and no guess."""
    decision = ground(evidence(command(this("this")), LEMONS))
    g = decision.grounded
    assert (g.status, g.reason) == (Status.AMBIGUOUS, "I did not see which thing you pointed at.")
    assert set(decision.doubt.choices) == {t.id for t in LEMONS}


def test_a_misheard_noun_with_a_plain_gesture_is_asked_about_and_not_guessed():
    """ "Tomato" heard, and a finger on the red bowl."""
    heard = this("tomato")
    decision = ground(evidence(command(heard), LEMONS, at(LEMONS[2], tip=(0.85, -0.1, 0.95))))
    assert decision.grounded.status is Status.AMBIGUOUS
    assert decision.doubt.choices == ("bowl_1",)


def test_a_gesture_of_which_little_was_seen_weighs_less():
    seen = [
        ground(evidence(command(this("lemon")), LEMONS, at(LEMONS[0], times=np.arange(0.5, 0.5 + 0.1 * n, 0.1))))
        for n in (1, 3, 8)
    ]
    shares = [d.grounded.object_candidates[0].probability for d in seen]
    assert shares == sorted(shares)
    assert shares[0] < 0.98 < shares[2]


def test_the_left_one_is_on_the_robots_left():
    g = ground(evidence(command(reference("left lemon", 0, 1)), LEMONS)).grounded
    assert g.object.id == "lemon_2"


def test_a_smaller_one_is_chosen_among_its_kind_only():
    """R13: a size word selects."""
    things = [
        Thing("box_1", "box", 0.6, 0.2),
        Thing("bottle_1", "bottle", 0.6, -0.2),
        Thing("lemon_1", "lemon", 0.7, 0),
    ]
    cmd = command(reference("small object", 0, 1))
    assert ground(evidence(cmd, things)).grounded.object.id == "lemon_1"
    assert ground(evidence(command(reference("small box", 0, 1)), things)).grounded.object.id == "box_1"


def test_a_thing_is_found_by_what_stands_beside_it():
    things = [
        Thing("mug_1", "mug", 0.6, 0.3),
        Thing("mug_2", "mug", 0.6, -0.3),
        Thing("bottle_1", "bottle", 0.6, -0.18),
    ]
    anchor = reference("bottle", 0.5, 0.9)
    cmd = command(reference("mug", 0, 0.4, anchor=anchor, anchor_relation="next_to"))
    assert ground(evidence(cmd, things)).grounded.object.id == "mug_2"


def test_a_gesture_at_the_reference_does_not_pick_the_answer():
    """R13: "the mug next to this bottle": the finger is on the bottle, a mug under the finger's line is not meant."""
    things = [
        Thing("mug_1", "mug", 0.7, 0.28),
        Thing("bottle_1", "bottle", 0.6, 0.3),
        Thing("mug_2", "mug", 0.6, 0.4),
        Thing("bottle_2", "bottle", 0.6, -0.3),
        Thing("mug_3", "mug", 0.6, -0.2),
    ]
    anchor = reference("bottle", 0.5, 0.9, deictic="this")
    cmd = command(reference("mug", 0.2, 0.9, anchor=anchor, anchor_relation="next_to"))
    g = ground(evidence(cmd, things, at(things[3], tip=(0.8, -0.3, 0.95)))).grounded
    assert g.object.id == "mug_3"


def test_it_is_the_thing_that_was_moved_before():
    first = ground(evidence(command(reference("red bowl", 0, 1)), LEMONS)).grounded
    memory = DiscourseMemory("bowl", first.object, (first.object.geometry.centroid,))
    it = reference("it", 0, 1, concrete=False, anaphoric=True)
    assert ground(evidence(command(it), LEMONS), memory=memory).grounded.object.id == "bowl_1"
    assert ground(evidence(command(it), LEMONS)).grounded.status is Status.FAILED


def test_a_resolved_pronoun_does_not_look_back():
    """The parser marks a noun that "it" stood for; what was moved before must not win over the noun."""
    first = ground(evidence(command(reference("red bowl", 0, 1)), LEMONS)).grounded
    memory = DiscourseMemory("bowl", first.object, (first.object.geometry.centroid,))
    noun = reference("blue bowl", 0, 1, anaphoric=True)
    assert ground(evidence(command(noun), LEMONS), memory=memory).grounded.object.id == "bowl_2"


def test_nothing_at_all_on_the_table_is_no_crash():
    assert ground(evidence(command(reference("lemon", 0, 1)), [])).grounded.status is Status.FAILED


def test_without_a_camera_pose_things_are_still_chosen():
    g = ground(evidence(command(this("lemon")), LEMONS, at(LEMONS[0], metric=False), view=View())).grounded
    assert g.object.id == "lemon_1"


def test_places_and_sizes_are_not_asked_of_the_detector():
    cmd = command(reference("small left red mug", 0, 1), reference("one", 1, 2, concrete=False, other=True))
    assert phrases_for(cmd) == ("red mug", "mug", "container", "objects")
    assert detector_phrase(reference("this red thing", 0, 1, modifiers=("red",), deictic="this")) == "red object"
    assert VIEW.camera is not None
