# SPDX-License-Identifier: Apache-2.0
"""Scenes and scenarios are read whole, and refused with one line that names what is wrong."""

from __future__ import annotations

import json
import math
from itertools import combinations

import pytest
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import KINDS
from uncom_sim.objects.footprint import outline
from uncom_sim.types import Table
from uncom_sim.world.intended_meaning import meaning_of, with_say
from uncom_sim.world.options import SCENE_VARIATION
from uncom_sim.world.scene_file import load_scenario, load_scene, scenario_names, scene_from_dict
from uncom_sim.world.scene_variation import vary_scene

LEMON = {"id": "l", "kind": "lemon", "x": 0.6, "y": 0.1}
BOWL = {"id": "b", "kind": "bowl", "colour": "red", "x": 0.62, "y": -0.2}


def _scene(**fields):
    return {"objects": [LEMON, BOWL], "say": "take the lemon", "point_object": None, "point_target": None, **fields}


def test_a_file_gives_the_scene_it_describes(tmp_path):
    path = tmp_path / "kitchen.json"
    path.write_text(
        json.dumps(_scene(point_object="l", point_target=[0.7, 0.3], table={"x": [0.5, 1.0], "height": 0.8}))
    )
    scene = load_scene(path)
    assert scene.name == "kitchen"
    assert [(o.id, o.kind, o.colour, o.x, o.y, o.yaw) for o in scene.objects] == [
        ("l", "lemon", "yellow", 0.6, 0.1, 0.0),
        ("b", "bowl", "red", 0.62, -0.2, 0.0),
    ]
    assert (scene.point_object, scene.point_target) == ("l", (0.7, 0.3))
    assert scene.table == Table(0.5, 1.0, -0.5, 0.5, 0.8)


def test_every_kind_is_accepted_in_words_and_with_underscores():
    for kind in KINDS:
        for name in (kind, kind.replace(" ", "_"), kind.upper()):
            scene = scene_from_dict(_scene(objects=[{"kind": name, "x": 0.7, "y": 0.0}]))
            assert scene.objects[0].kind == kind


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"objects": [{"id": "z", "kind": "zebra", "x": 0.6, "y": 0}]},
            "object 'z': unknown kind 'zebra'; kinds are: banana",
        ),
        ({"objects": [{**LEMON, "colour": "mauve"}]}, "object 'l': unknown colour 'mauve'; colours are: red"),
        ({"objects": [LEMON, {**BOWL, "x": 0.61, "y": 0.05}]}, "objects 'l' and 'b' overlap"),
        ({"objects": [{**LEMON, "x": 1.2}]}, r"object 'l' at \(1.2, 0.1\) is not on the table: x must be between 0.45"),
        ({"objects": [{**LEMON, "x": "near"}]}, "object 'l': \"x\" must be a number"),
        ({"objects": [{**LEMON, "y": math.nan}]}, "object 'l': \"y\" must be a number"),
        ({"objects": [{"id": "l", "kind": "lemon", "y": 0.0}]}, "object 'l': \"x\" is missing"),
        ({"objects": [LEMON, {**LEMON, "x": 0.8}]}, "object 'l': another object has the same id"),
        ({"objects": [{**LEMON, "colr": "red"}]}, "unknown field 'colr'; fields are: id, kind"),
        ({"objects": "lemon"}, '"objects" must be a list'),
        ({"point_object": "cup"}, "\"point_object\": there is no object 'cup'; objects are: l, b"),
        ({"point_target": [3.0, 0.0]}, r'"point_target": the place \(3, 0\) is not on the table'),
        ({"point_target": 7}, '"point_target" must be the id of an object, a place'),
        ({"say": 5}, '"say" must be the sentence'),
        ({"table": {"x": [0.9, 0.5]}}, '"table": "x" must run from a lower to a higher number'),
        ({"table": {"height": 3.0}}, '"table": "height" must be between'),
        ({"person": {"side": "above"}}, '"side" must be one of: far, left, right'),
        ({"person": {"speed": 9000}}, '"speed" must be between 80 and 260'),
    ],
)
def test_what_cannot_be_is_refused_by_name_in_one_line(fields, text):
    with pytest.raises(SceneError, match=text) as caught:
        scene_from_dict(_scene(**fields))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "there is no scene file"),
        ("{", "is not JSON"),
        ("[1]", "must be an object with the fields"),
        (b"\xff\xfe\x00", "cannot read"),
    ],
)
def test_a_bad_file_is_one_line_with_its_name(tmp_path, content, text):
    path = tmp_path / "s.json"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(SceneError, match=text) as caught:
        load_scene(path)
    assert "s.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_papers_six_scenarios_are_there_by_number_and_by_name():
    assert scenario_names() == ("i", "ii", "iii", "iv", "v", "vi")
    assert load_scenario("banana_in_bowl") == load_scenario("i")
    assert load_scenario("Right-of-box") == load_scenario("v")
    with pytest.raises(SceneError, match=r"no scenario 'vii'; scenarios are: i \(banana_in_bowl\), ii"):
        load_scenario("vii")


@pytest.mark.parametrize("name", ["i", "ii", "iii", "iv", "v", "vi"])
def test_seeds_move_things_but_keep_them_apart_and_the_meaning(name):
    written = load_scenario(name)
    assert vary_scene(written, 0) == written
    seen = set()
    for seed in range(1, 15):
        scene = vary_scene(written, seed)
        assert scene == vary_scene(written, seed)
        assert [o.id for o in scene.objects] == [o.id for o in written.objects]
        outlines = [outline(o) for o in scene.objects]
        assert min(a.distance(b) for a, b in combinations(outlines, 2)) >= SCENE_VARIATION.gap_m
        assert meaning_of(scene) is scene.meaning
        if isinstance(scene.point_target, tuple):
            assert scene.meaning.area == scene.point_target
        seen.add((scene.objects[0].x, scene.objects[0].y))
    assert len(seen) == 14


@pytest.mark.parametrize(
    ("say", "pointed_object", "pointed_target", "meant"),
    [
        ("take the lemon and put it in this bowl", "lemon_1", "bowl_1", ("lemon_1", "in", "bowl_1")),
        ("put the pear in the white bowl", "pear_1", "bowl_2", ("pear_1", "in", "bowl_2")),
        ("take this and put it to the left of the pear", "lemon_1", "pear_1", ("lemon_1", "left_of", "pear_1")),
        ("take the banana", "banana_1", None, ("banana_1", "none", None)),
        ("hello there", None, None, None),
        ("take the bowl", None, None, None),
    ],
)
def test_another_sentence_moves_the_finger_to_what_it_names(say, pointed_object, pointed_target, meant):
    scene = with_say(load_scenario("iv"), say)
    assert (scene.point_object, scene.point_target) == (pointed_object, pointed_target)
    found = scene.meaning
    assert (None if found is None else (found.object, found.relation, found.target)) == meant


def test_what_the_scenarios_mean_also_follows_from_words_and_pointing():
    for name in scenario_names():
        scene = load_scenario(name)
        assert with_say(scene, scene.say).meaning == scene.meaning
