# SPDX-License-Identifier: Apache-2.0
"""Parameters of the chained cores, and the paper's rules on made-up scenes."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from uncom_bringup.chain.config import ChainConfig, load_chain_config
from uncom_bringup.exceptions import BadInputError
from uncom_common.camera import PinholeCamera
from uncom_common.primitive import Primitive
from uncom_language.types import Act, Command, Reference, Relation, Span
from uncom_perception.types import Box, Detection, Hand, HandsFrame, Scene, TableSurface
from uncom_reasoner.types import Evidence, Status, TargetKind, View
from uncom_sim.bench_understanding.judging.options import PAPER_RULES
from uncom_sim.bench_understanding.judging.paper_rules import Line, decide_as_published, pointing_line

CAMERA = PinholeCamera(640, 480, 500.0, 500.0, 320.0, 240.0)
OVERHEAD = np.diag([1.0, -1.0, -1.0, 1.0])
OVERHEAD[:3, 3] = (0.0, 0.0, 2.0)


def test_without_files_the_chain_has_the_nodes_own_defaults():
    config = load_chain_config()
    for field in fields(ChainConfig):
        value = getattr(config, field.name)
        assert value == type(value)()


def test_a_parameter_file_reaches_the_node_it_names(tmp_path):
    file = tmp_path / "p.yaml"
    file.write_text("reasoner_node:\n  ros__parameters:\n    cell_m: 0.08\n    use_sim_time: true\n")
    assert load_chain_config([file]).reasoner.cell_m == 0.08
    assert load_chain_config([file]).gesture == ChainConfig().gesture


def test_a_parameter_that_no_node_knows_is_refused(tmp_path):
    file = tmp_path / "p.yaml"
    file.write_text("gesture_node:\n  ros__parameters:\n    luck: 1\n")
    with pytest.raises(BadInputError, match="luck"):
        load_chain_config([file])
    with pytest.raises(BadInputError, match="cannot read"):
        load_chain_config([tmp_path / "none.yaml"])


def thing(name, u, v, scores, size=30.0):
    box = Box(u - size, v - size, u + size, v + size)
    return Detection(name, name, 1.0, box, np.zeros((2, 2), bool), phrase_scores=scores)


def hand_at(base, tip, z=0.0, stamp_s=2.0):
    marks = np.zeros((21, 3))
    marks[5, :2], marks[8, :2], marks[8, 2] = base, tip, z
    return HandsFrame(stamp_s, "camera", 640, 480, (Hand("right", 1.0, marks),))


def command(target, relation, primitive=Primitive.PUT_IN):
    object_ = Reference("mug", "mug", Span(1.0, 2.0))
    return Command("u", Act.COMMAND, "", "put", primitive, object=object_, target=target, relation=relation)


def evidence(said, things, phrases):
    corners = np.array([(-0.8, -0.6, 0.7), (0.8, -0.6, 0.7), (0.8, 0.6, 0.7), (-0.8, 0.6, 0.7)])
    outline = CAMERA.project((corners - OVERHEAD[:3, 3]) @ OVERHEAD[:3, :3])
    table = TableSurface(corners, np.array([0.0, 0.0, 1.0]), outline)
    scene = Scene(1.0, "base_footprint", things, table, (0.0,) * len(phrases), "made up")
    return Evidence(said, scene, phrases, View(CAMERA, OVERHEAD))


HERE = Reference("here", "here", Span(3.0, 4.0), concrete=False, deictic="here")
PLATE = Reference("plate", "plate", Span(3.0, 4.0))
PHRASES = ("mug", "plate", "container", "objects")


def test_the_line_has_no_end_on_either_side():
    """As published: a thing behind the hand is as near to the line as one before it."""
    line = Line(np.array([100.0, 100.0]), np.array([150.0, 100.0]))
    assert line.distance(np.array([[300.0, 110.0], [20.0, 110.0]])).tolist() == [10.0, 10.0]


def test_of_several_named_things_the_nearest_to_the_line_is_taken():
    things = (
        thing("a", 300, 130, (0.9, 0, 0, 0.5)),
        thing("b", 300, 300, (0.95, 0, 0, 0.5)),
        thing("p", 500, 250, (0, 0.9, 0, 0.5)),
    )
    said = command(PLATE, Relation.ON)
    got = decide_as_published(evidence(said, things, PHRASES), [hand_at((100, 100), (150, 105))])
    assert (got.status, got.object.id, got.target.detection.id) == (Status.GROUNDED, "a", "p")


def test_without_a_hand_the_best_name_is_taken():
    things = (
        thing("a", 300, 130, (0.9, 0, 0, 0.5)),
        thing("b", 300, 300, (0.95, 0, 0, 0.5)),
        thing("p", 500, 250, (0, 0.9, 0, 0.5)),
    )
    got = decide_as_published(evidence(command(PLATE, Relation.ON), things, PHRASES), [])
    assert got.object.id == "b"


def test_the_hand_whose_fingertip_has_the_smallest_z_points():
    near, far = hand_at((0, 0), (10, 0), z=-5.0).hands[0], hand_at((0, 0), (0, 10), z=3.0).hands[0]
    frame = HandsFrame(2.0, "camera", 640, 480, (far, near))
    assert pointing_line([frame], 2.0).tip.tolist() == [10.0, 0.0]


def test_frames_without_a_hand_are_tried_again_a_little_earlier_and_later():
    nobody = HandsFrame(2.0, "camera", 640, 480, ())
    assert pointing_line([nobody, hand_at((0, 0), (10, 0), stamp_s=2.0 + PAPER_RULES.retry_s)], 2.0) is not None
    assert pointing_line([nobody, hand_at((0, 0), (10, 0), stamp_s=2.2)], 2.0) is None


def test_here_is_a_container_where_there_is_one_and_a_free_cell_where_there_is_none():
    mug = thing("a", 300, 130, (0.9, 0, 0, 0.5))
    bowl = thing("bowl", 500, 250, (0, 0, 0.9, 0.5))
    hands = [hand_at((100, 300), (150, 300), stamp_s=4.0)]
    said = command(HERE, Relation.HERE, Primitive.PLACE)
    assert decide_as_published(evidence(said, (mug, bowl), PHRASES), hands).target.detection.id == "bowl"
    place = decide_as_published(evidence(said, (mug,), PHRASES), hands).target
    assert place.kind is TargetKind.AREA
    assert abs(place.pose[2, 3] - 0.7) < 1e-9


def test_a_cell_left_of_a_thing_lies_left_of_it_in_the_picture():
    things = (thing("a", 300, 130, (0.9, 0, 0, 0.5)), thing("p", 400, 250, (0, 0.9, 0, 0.5)))
    got = decide_as_published(evidence(command(PLATE, Relation.LEFT_OF, Primitive.PLACE), things, PHRASES), [])
    assert got.target.pose[0, 3] < (400 - 320) / 500 * 1.3
