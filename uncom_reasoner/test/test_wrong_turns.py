# SPDX-License-Identifier: Apache-2.0
"""Mistakes that other implementations of this method have made; each test says what happens instead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reasoner_scenes import CAMERA, POSE, SIZES, TABLE_Z, Thing, command, evidence, pixels, pointing, reference
from uncom_common.primitive import Primitive
from uncom_language.types import Relation
from uncom_reasoner.config import PlacingConfig, ReasonerConfig
from uncom_reasoner.dialogue.conversation import Conversation
from uncom_reasoner.evidence.sensor_memory import SensorMemory
from uncom_reasoner.grounding.ground import ground
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.types import Status, TargetKind, View
from uncom_reasoner.weights import load_weights

THINGS = [Thing("lemon_1", "lemon", 0.55, 0.3), Thing("box_1", "box", 0.62, 0.0), Thing("bowl_1", "bowl", 0.6, -0.3)]
NOW = np.arange(0.2, 1.2, 0.1)
LATER = np.arange(1.8, 2.6, 0.1)


def relative(relation: Relation, **kwargs):
    return command(
        reference("lemon", 0, 1), reference("box", 1.9, 2.3), relation=relation, primitive=Primitive.PLACE, **kwargs
    )


def here(start=1.9, obj=None):
    return command(
        obj or reference("lemon", 0, 1),
        reference("here", start, start + 0.4, concrete=False, deictic="here"),
        relation=Relation.HERE,
        primitive=Primitive.PLACE,
    )


def test_m5_object_and_target_that_end_together_or_after_the_last_image_are_no_trouble():
    memory = SensorMemory(ReasonerConfig())
    for stamp in np.arange(0.0, 2.0, 0.125):
        memory.images.add(float(stamp), "image")
    same = command(reference("lemon", 1.0, 1.5), reference("bowl", 1.0, 1.5))
    late = command(reference("lemon", 8.0, 9.0), reference("bowl", 9.0, 10.0))
    for cmd in (same, late):
        choice = memory.choose_frame(cmd)
        assert memory.image_at(choice.stamp_s) == "image"
        assert memory.nearest_image_s(10.0) == pytest.approx(1.875)
    assert ground(evidence(same, THINGS)).grounded.status is Status.GROUNDED


def test_m12_a_thing_that_stands_where_the_object_was_put_down_is_in_the_way():
    """Object and place are judged in the same scene: with the gestures of both, nothing is put onto the box."""
    hands = pointing((0.55, 0.3, TABLE_Z), (0.8, 0.3, 0.9), NOW) + pointing((0.62, 0, TABLE_Z), (0.8, 0.05, 0.9), LATER)
    g = ground(evidence(here(obj=reference("this", 0.4, 0.9, deictic="this", concrete=False)), THINGS, hands)).grounded
    assert (g.status, g.object.id) == (Status.GROUNDED, "lemon_1")
    away = np.abs(g.target.pose[:2, 3] - [0.62, 0.0])
    half = (np.array(SIZES["box"][:2]) + np.array(SIZES["lemon"][:2])) / 2.0
    assert (away > half - 0.01).any()


@pytest.mark.parametrize(
    ("relation", "holds"),
    [
        (Relation.IN_FRONT_OF, lambda d: -d[0] > abs(d[1])),
        (Relation.BEHIND, lambda d: d[0] > abs(d[1])),
        (Relation.LEFT_OF, lambda d: d[1] > abs(d[0])),
        (Relation.RIGHT_OF, lambda d: -d[1] > abs(d[0])),
        (Relation.NEXT_TO, lambda d: np.hypot(*d) < 0.25),
        (Relation.NEAR, lambda d: np.hypot(*d) < 0.4),
    ],
)
def test_m18_m19_every_relation_is_its_own_and_needs_no_gesture(relation, holds):
    """ "In front" is no left or right; the place is near the reference and not near a fingertip."""
    g = ground(evidence(relative(relation), THINGS)).grounded
    assert g.status is Status.GROUNDED
    assert holds(g.target.pose[:2, 3] - [0.62, 0.0])


def test_m18_between_is_between():
    cmd = relative(Relation.BETWEEN, reference2=reference("bowl", 2.4, 2.6))
    x, y = ground(evidence(cmd, THINGS)).grounded.target.pose[:2, 3]
    assert -0.3 < y < 0.0
    assert 0.5 < x < 0.72


def test_the_middle_of_the_table_is_its_middle_whatever_part_of_the_words_is_left():
    for target, text in (("middle", "put it in the middle"), ("table", "put it in the middle of the table")):
        cmd = command(
            reference("lemon", 0, 1),
            reference(target, 1.9, 2.3),
            relation=Relation.ON,
            primitive=Primitive.PUT_ON,
            text=text,
        )
        things = [THINGS[0], THINGS[2]]
        x, y = ground(evidence(cmd, things)).grounded.target.pose[:2, 3]
        assert np.hypot(x - 0.7, y) < 0.1


def test_the_top_of_a_box_is_the_box():
    top = reference("top", 1.5, 2.3, anchor=reference("box", 1.9, 2.3), anchor_relation="next_to")
    cmd = command(reference("lemon", 0, 1), top, relation=Relation.ON, primitive=Primitive.PUT_ON)
    g = ground(evidence(cmd, THINGS)).grounded
    assert (g.status, g.target.detection.id, g.relation) == (Status.GROUNDED, "box_1", "on")


def test_m21_a_ray_reaches_the_table_and_not_only_the_fingertip():
    tip = (0.85, 0.35, 1.05)
    hands = pointing((0.55, -0.05, TABLE_Z), tip, LATER)
    g = ground(evidence(here(), THINGS[:1], hands)).grounded
    assert np.hypot(*(g.target.pose[:2, 3] - [0.55, -0.05])) < 0.08
    assert np.hypot(*(g.target.pose[:2, 3] - tip[:2])) > 0.3


def test_m24_a_failure_has_a_status_and_a_reason_and_changes_nothing():
    talk = Conversation(load_weights(), PlacingConfig())
    memory = talk.memory
    turn = talk.decide(evidence(command(reference("tomato", 0, 1)), THINGS), 0.0)
    assert turn.decisions[0].grounded.status is Status.FAILED
    assert turn.decisions[0].grounded.reason == "I do not see the tomato on the table."
    assert talk.memory is memory


def test_r3_what_is_sent_to_the_arm_is_what_was_understood_and_not_the_first_detection():
    g = ground(evidence(command(reference("bowl", 0, 1)), THINGS)).grounded
    assert g.object.id == "bowl_1"
    assert g.object.id not in {d.id for d in g.scene}
    assert {d.id for d in g.scene} == {"lemon_1", "box_1"}


def test_r5_a_command_with_a_relation_is_not_called_ambiguous():
    decision = ground(evidence(relative(Relation.LEFT_OF), THINGS))
    assert (decision.grounded.status, decision.doubt) == (Status.GROUNDED, None)


def test_r10_without_depth_things_and_places_are_still_found():
    """A frame without depth: pixels only, and no number that is made up."""
    made = evidence(here(), THINGS, pointing((0.55, 0.05, TABLE_Z), (0.7, 0.1, 0.9), LATER, metric=False))
    flat = tuple(replace(d, geometry=None) for d in made.scene.detections)
    table = replace(made.scene.table, polygon=np.zeros((0, 3)))
    made = replace(
        made,
        scene=replace(made.scene, detections=flat, table=table, frame_id="camera"),
        view=View(CAMERA, np.eye(4)),
        rays=observe_rays(pointing((0.55, 0.05, TABLE_Z), (0.7, 0.1, 0.9), LATER, metric=False), lambda _: None),
    )
    g = ground(made).grounded
    assert g.object.id == "lemon_1"
    assert g.status in (Status.GROUNDED, Status.FAILED, Status.AMBIGUOUS)
    assert g.target.pose is None


def test_r12_a_second_this_here_is_grounded_by_its_own_gestures():
    """Two commands in a row, each with "this" and "here": the second is not overwritten with the first."""
    things = [*THINGS, Thing("mug_1", "mug", 0.58, -0.12)]
    hands = [
        *pointing((0.55, 0.3, TABLE_Z + 0.02), (0.8, 0.3, 0.9), NOW),
        *pointing((0.75, 0.35, TABLE_Z), (0.9, 0.3, 0.9), LATER),
        *pointing((0.58, -0.12, TABLE_Z + 0.04), (0.8, -0.15, 0.95), NOW + 4.0),
        *pointing((0.52, 0.15, TABLE_Z), (0.7, 0.2, 0.9), LATER + 4.0),
    ]
    talk = Conversation(load_weights(), PlacingConfig())
    found = []
    for offset in (0.0, 4.0):
        this = reference("this", 0.4 + offset, 0.9 + offset, concrete=False, deictic="this")
        made = evidence(replace(here(1.9 + offset, this), index=int(offset > 0)), things, hands)
        found.append(talk.decide(made, offset).decisions[0].grounded)
    assert [g.object.id for g in found] == ["lemon_1", "mug_1"]
    first, second = (g.target.pose[:2, 3] for g in found)
    assert np.hypot(*(first - [0.75, 0.35])) < 0.1
    assert np.hypot(*(second - [0.52, 0.15])) < 0.1


@pytest.mark.parametrize("y", [-0.42, -0.2, 0.0, 0.2, 0.42])
def test_r14_every_part_of_the_picture_can_be_pointed_at(y):
    things = [Thing("lemon_1", "lemon", 0.7, 0.1 if y <= 0.0 else -0.1)]
    g = ground(evidence(here(), things, pointing((0.55, y, TABLE_Z), (0.7, y * 0.9, 0.9), LATER))).grounded
    assert g.target.kind is TargetKind.AREA
    assert np.hypot(*(g.target.pose[:2, 3] - [0.55, y])) < 0.06
    assert (pixels(g.target.area)[:, 0] > 0).all()
    assert POSE.shape == (4, 4)
