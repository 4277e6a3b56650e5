# SPDX-License-Identifier: Apache-2.0
"""Reasons, pictures and messages say what was decided."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from geometry_msgs.msg import Polygon
from reasoner_scenes import CAMERA, TABLE_Z, VIEW, Thing, command, evidence, pixels, pointing, reference
from std_msgs.msg import Header
from uncom_common.primitive import Primitive
from uncom_language.types import Relation
from uncom_perception.types import Attribute
from uncom_reasoner.conversions import (
    explanation_from_msg,
    explanation_to_msg,
    grounded_command_from_msg,
    grounded_command_to_msg,
)
from uncom_reasoner.exceptions import InvalidGroundingError, InvalidWeightsError
from uncom_reasoner.explanation.annotated_image import annotate, caption
from uncom_reasoner.explanation.explanation import explain
from uncom_reasoner.explanation.options import ANNOTATION
from uncom_reasoner.grounding.decision import failed_command
from uncom_reasoner.grounding.ground import ground
from uncom_reasoner.grounding.phrasing import compose_sentence
from uncom_reasoner.types import Decision, Status, TargetKind, View
from uncom_reasoner.weights import Weights, load_weights

from uncom_interfaces.msg import GroundedCommand as GroundedCommandMsg

THINGS = [
    Thing("lemon_1", "lemon", 0.6, 0.1),
    Thing("lemon_2", "lemon", 0.65, 0.32),
    Thing("bowl_1", "bowl", 0.7, -0.2),
    Thing("box_1", "box", 0.55, -0.3),
]
HANDS = pointing((0.6, 0.1, TABLE_Z + 0.02), (0.75, 0.2, 0.9), np.arange(0.2, 1.0, 0.1))
LATER = pointing((0.6, -0.05, TABLE_Z), (0.75, 0.05, 0.9), np.arange(1.8, 2.4, 0.1))


def commands():
    lemon = reference("lemon", 0.4, 0.8, deictic="this")
    here = reference("here", 1.9, 2.2, concrete=False, deictic="here")
    return {
        "thing": (
            command(lemon, reference("bowl", 1.9, 2.2), text="put this lemon in the bowl", action_text="put"),
            HANDS,
        ),
        "area": (command(lemon, here, relation=Relation.HERE, primitive=Primitive.PLACE), HANDS + LATER),
        "relative": (
            command(lemon, reference("box", 1.9, 2.2), relation=Relation.LEFT_OF, primitive=Primitive.PLACE),
            HANDS,
        ),
        "pick": (command(lemon), HANDS),
        "ambiguous": (command(reference("lemon", 0.4, 0.8), reference("bowl", 1.9, 2.2)), []),
        "unseen": (command(reference("pear", 0.4, 0.8), reference("bowl", 1.9, 2.2)), HANDS),
        "ordinal": (command(reference("lemon", 0.4, 0.8, ordinal=2, ordinal_side="left")), []),
        "any": (command(reference("lemon", 0.4, 0.8), text="take a lemon"), []),
        "compared": (
            command(
                reference("thing", 0.4, 0.8, concrete=False, comparison="bigger", compared_to=reference("box", 0.6, 1))
            ),
            [],
        ),
        "between": (
            command(
                lemon,
                reference("bowl", 1.9, 2.2),
                reference2=reference("box", 2.3, 2.5),
                relation=Relation.BETWEEN,
                primitive=Primitive.PLACE,
            ),
            HANDS,
        ),
        "squarely": (
            command(lemon, here, relation=Relation.HERE, primitive=Primitive.PLACE),
            HANDS + pointing((0.7, -0.2, TABLE_Z + 0.02), (0.72, -0.15, 0.9), np.arange(1.8, 2.4, 0.1)),
        ),
    }


NAMES = sorted(commands())


@pytest.fixture(name="decided", params=NAMES)
def _decided(request):
    cmd, hands = commands()[request.param]
    e = evidence(cmd, THINGS, hands)
    return cmd, e, ground(e)


def recomputed(part, thresholds):
    """Choose again from a part of an explanation alone."""
    candidates = part["candidates"]
    logs = np.array([sum(c["factors"].values()) for c in candidates])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    assert np.allclose(p, [c["probability"] for c in candidates], atol=1e-9)
    things = [(q, c["id"]) for q, c in zip(p, candidates, strict=True) if c["id"] != "none"]
    things.sort(key=lambda entry: -entry[0])  # the first of those that are alike
    total = sum(q for q, _ in things)
    second = things[1][0] if len(things) > 1 else 0.0
    clear = things[0][0] / total >= thresholds["min_probability"] and things[0][0] >= thresholds["min_odds"] * second
    if 1.0 - total > total or not (clear or part["rule"] in ("any will do", "best place")):
        return None
    return things[0][1]


def test_the_choice_follows_from_the_explanation(decided):
    """Every number of the explanation is the one that was used: from them alone comes the same choice."""
    cmd, _, decision = decided
    found = json.loads(json.dumps(explain(cmd, decision, 1.0, load_weights())))
    for name in ("object", "target", "reference", "second"):
        part = found[name]
        if part is not None and part["candidates"]:
            assert recomputed(part, found["thresholds"]) == part["chosen"]
            marked = [c["id"] for c in part["candidates"] if c["chosen"]]
            assert marked == ([part["chosen"]] if part["chosen"] is not None else [])
    if found["status"] == "GROUNDED" and found["target"]["kind"] == "AREA":
        chosen = [c for c in found["cells"] if c["chosen"]]
        assert [c["id"] for c in chosen] == [found["target"]["chosen"]]
        assert chosen[0]["occupied_by"] == ""
    if found["readings"]:
        best = max(found["readings"], key=lambda r: r["probability"])
        assert best["chosen"]
        assert best["perspective"] == found["perspective"]


def test_what_is_asked_about_is_in_the_explanation():
    cmd, hands = commands()["ambiguous"]
    found = explain(cmd, ground(evidence(cmd, THINGS, hands)), 1.0, load_weights())
    assert (found["doubt"]["part"], sorted(found["doubt"]["choices"])) == ("object", ["lemon_1", "lemon_2"])
    assert found["object"]["rule"] is None


def test_the_explanation_says_what_the_gesture_and_the_words_did():
    cmd, hands = commands()["thing"]
    found = explain(cmd, ground(evidence(cmd, THINGS, hands)), 1.0, load_weights())
    assert found["object"]["chosen"] == "lemon_1"
    assert found["without"]["gesture"]["object"]["probability"] < 0.6
    assert found["rays"]["object"]["dwells"][0]["stamps"] == pytest.approx(np.arange(0.2, 1.0, 0.1))
    assert not found["rays"]["target"]["present"]


@pytest.mark.parametrize("view", [VIEW, View()], ids=["camera", "no camera"])
@pytest.mark.parametrize("mask", [True, False], ids=["mask", "no mask"])
def test_a_picture_is_made_of_every_decision(decided, view, mask):
    """M11, M23: with and without gesture, mask, camera pose and target."""
    _, _, decision = decided
    if not mask and decision.grounded.object is not None:
        bare = replace(decision.grounded.object, mask=np.zeros((0, 0), dtype=bool))
        decision = replace(decision, grounded=replace(decision.grounded, object=bare))
    frame = np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8)
    picture = annotate(frame, frame.copy(), decision, view)
    assert picture.shape[1] == 2 * CAMERA.width + 4
    assert (frame == 90).all()
    left = picture[: CAMERA.height, : CAMERA.width]
    if decision.grounded.object is not None:
        assert (left == ANNOTATION.chosen_colour).all(axis=2).sum() > 50
    if decision.object_ray is not None and decision.object_ray.present:
        assert (left == ANNOTATION.ray_colour).all(axis=2).sum() > 50


def test_an_area_is_drawn_where_it_is():
    cmd, hands = commands()["area"]
    decision = ground(evidence(cmd, THINGS, hands))
    frame = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
    right = annotate(frame, frame, decision, VIEW)[: CAMERA.height, CAMERA.width + 4 :]
    rows, columns = np.nonzero((right == ANNOTATION.chosen_colour).all(axis=2))
    wanted = pixels(decision.grounded.target.area).mean(axis=0)
    assert np.hypot(columns.mean() - wanted[0], rows.mean() - wanted[1]) < 12


def test_the_caption_is_object_action_target():
    cmd, hands = commands()["thing"]
    assert caption(ground(evidence(cmd, THINGS, hands))) == "this lemon - put - bowl"
    assert caption(Decision(failed_command(command(None), "No."))) == "take: No."


def test_a_grounded_command_survives_the_message(decided):
    _, _, decision = decided
    grounded = replace(decision.grounded, stamp_s=12.5, latency_s=0.25, object_frame_s=1.5)
    back = grounded_command_from_msg(grounded_command_to_msg(grounded))
    for name in ("stamp_s", "status", "reason", "object_text", "target_text", "primitive", "relation", "backends"):
        assert getattr(back, name) == getattr(grounded, name)
    assert [c.id for c in back.target_candidates] == [c.id for c in grounded.target_candidates]
    assert (back.object is None) == (grounded.object is None)
    assert back.target.kind is grounded.target.kind
    assert np.allclose(back.target.area, grounded.target.area, atol=1e-6)
    if grounded.target.pose is not None:
        assert np.allclose(back.target.pose, grounded.target.pose, atol=1e-9)
    if grounded.target.kind is TargetKind.OBJECT:
        assert np.array_equal(back.target.detection.mask, grounded.target.detection.mask)
    for a, b in zip(back.object_candidates, grounded.object_candidates, strict=True):
        assert [f.name for f in a.factors] == [f.name for f in b.factors]
        assert a.probability == pytest.approx(b.probability, abs=1e-6)


def test_a_status_that_does_not_exist_is_refused():
    with pytest.raises(InvalidGroundingError, match="Status 9 is not one of 0 GROUNDED, 1 FAILED, 2 AMBIGUOUS"):
        grounded_command_from_msg(GroundedCommandMsg(status=9))
    assert len(Polygon().points) == 0


def test_an_explanation_survives_the_message(decided):
    cmd, _, decision = decided
    found = explain(cmd, decision, 1.0, load_weights())
    assert explanation_from_msg(explanation_to_msg(found, Header())) == json.loads(json.dumps(found))


def test_the_robot_says_what_it_understood():
    said = {}
    for name, (cmd, hands) in commands().items():
        said[name] = compose_sentence(cmd, ground(evidence(cmd, THINGS, hands)).grounded)
    assert said["thing"] == "I take the lemon and put it in the bowl."
    assert said["relative"] == "I take the lemon and put it to the left of the box."
    assert said["area"] == "I take the lemon and put it there, where you point."
    assert said["pick"] == "I take the lemon."
    assert said["unseen"] == "I do not see the pear on the table."


def test_the_robot_repeats_the_speakers_noun_and_adds_the_colour_of_what_was_pointed_at():
    cmd, hands = commands()["thing"]
    grounded = ground(evidence(cmd, THINGS, hands)).grounded
    seen = replace(grounded.object, label="apple", attributes=(Attribute("colour", "yellow", 0.9),))
    assert compose_sentence(cmd, replace(grounded, object=seen)) == "I take the yellow lemon and put it in the bowl."


def test_weights_are_data_and_bad_ones_are_named(tmp_path):
    assert isinstance(load_weights(), Weights)
    file = tmp_path / "weights.yaml"
    file.write_text("phrase: 1.0\nrays: 2\n")
    with pytest.raises(InvalidWeightsError, match=r"missing or unknown: .*rays"):
        load_weights(file)
    with pytest.raises(InvalidWeightsError, match="cannot read"):
        load_weights(tmp_path / "none.yaml")


def test_a_failed_command_keeps_the_words():
    grounded = failed_command(command(reference("lemon", 0, 1), reference("bowl", 1, 2)), "No camera.")
    assert (grounded.status, grounded.object_text, grounded.target_text) == (Status.FAILED, "lemon", "bowl")
