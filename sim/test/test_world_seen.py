# SPDX-License-Identifier: Apache-2.0
"""The world in PyBullet: things stand where the scene says, the hand is seen, and touches nothing."""

from __future__ import annotations

import logging
from dataclasses import replace

import mediapipe
import numpy as np
import pybullet
import pytest
from uncom_sim.person.hand_model import HandLandmark
from uncom_sim.person.hand_placement import robot_viewpoint
from uncom_sim.world.scene_file import load_scenario, scenario_names, scene_from_dict
from uncom_sim.world.simulator import Simulator
from uncom_sim.world.world import World


@pytest.fixture
def client():
    connected = pybullet.connect(pybullet.DIRECT)
    yield connected
    pybullet.disconnect(connected)


@pytest.mark.parametrize("name", scenario_names())
def test_every_scenario_comes_to_rest_where_it_says(client, name):
    world = World(client, load_scenario(name), 0)
    world.settle()
    before = world.object_states()
    world.settle(1.0)
    for state, earlier in zip(world.object_states(), before, strict=True):
        thing = world.scene.object(state.id)
        assert np.hypot(*(state.position[:2] - (thing.x, thing.y))) < 0.008
        assert np.linalg.norm(state.position - earlier.position) < 0.002
        assert (state.kind, state.colour) == (thing.kind, thing.colour)


def test_another_table_is_where_the_scene_puts_it(client):
    scene = scene_from_dict(
        {
            "objects": [{"kind": "cup", "x": 0.9, "y": 0.1}],
            "say": "",
            "table": {"x": [0.7, 1.3], "y": [-0.3, 0.4], "height": 0.6},
        }
    )
    world = World(client, scene, 1)
    world.settle()
    low, high = pybullet.getAABB(world.table_body, -1, physicsClientId=client)
    assert high == pytest.approx((1.3, 0.4, 0.6), abs=0.01)
    assert low[2] == pytest.approx(0.0, abs=0.01)
    assert world.object_states()[0].position[2] == pytest.approx(0.64, abs=0.003)


def test_the_hand_pushes_nothing_even_when_it_is_inside_something(client):
    world = World(client, load_scenario("iii"), 2)
    world.settle()
    before = world.object_states()
    person = world.person
    for t_s in np.arange(0.0, person.duration_s, 0.05):
        world.update_person(float(t_s))
        world.settle(1 / 60)
    bowl = world.object_states()[1].position
    pybullet.resetBasePositionAndOrientation(world.hand_body, bowl, (0, 0, 0, 1), physicsClientId=client)
    world.settle(0.2)
    for state, earlier in zip(world.object_states(), before, strict=True):
        assert np.linalg.norm(state.position - earlier.position) < 0.001
    assert not pybullet.getContactPoints(bodyA=world.hand_body, physicsClientId=client)


def test_the_hand_is_pixels_and_depth_only_while_it_is_there():
    simulator = Simulator(load_scenario("iv"), 0)
    try:
        _, empty = simulator.render_camera()
        simulator.start_person()
        pointing = simulator.world.person.pointing[0]
        _step_to(simulator, (pointing.start_s + pointing.end_s) / 2)
        _, seen = simulator.render_camera()
        assert (empty - seen > 0.02).sum() > 4000
        _step_to(simulator, simulator.world.person.duration_s + 0.05)
        _, gone = simulator.render_camera()
        assert (np.abs(empty - gone) > 0.06).mean() < 0.01  # noise at edges
    finally:
        simulator.close()


def _step_to(simulator, t_s):
    """Run until a time after the start of the simulation [s]; the person starts with it in these tests."""
    while simulator.time_s - simulator.options.start_time_s < t_s:
        simulator.step()


def test_seeds_change_light_and_person_but_not_the_things(client):
    other = pybullet.connect(pybullet.DIRECT)
    try:
        a, b = World(client, load_scenario("iii"), 1), World(other, load_scenario("iii"), 2)
        assert a.light != b.light
        assert a.person.attributes != b.person.attributes
        for x, y in zip(a.object_states(), b.object_states(), strict=True):
            assert np.allclose(x.pose, y.pose)
    finally:
        pybullet.disconnect(other)


CASES = [
    (name, side, hand)
    for name, side in (("iii", "far"), ("iv", "left"), ("vi", "far"), ("iv", "right"), ("iii", "right"), ("vi", "left"))
    for hand in ("left", "right")
]


@pytest.mark.slow
def test_mediapipe_finds_the_pointing_finger_from_every_side():
    """The detector is the real one; what is tested is that our hand looks like a hand to it."""
    eye = robot_viewpoint()
    errors, frames = [], 0
    with mediapipe.solutions.hands.Hands(static_image_mode=True, max_num_hands=2, min_detection_confidence=0.3) as find:
        for seed, (name, side, hand) in enumerate(CASES):
            scene = load_scenario(name)
            simulator = Simulator(replace(scene, person=replace(scene.person, side=side, hand=hand)), seed)
            person = simulator.world.person
            simulator.start_person()
            for pointing in person.pointing:
                for share in (0.2, 0.5, 0.8):
                    _step_to(simulator, (1 - share) * pointing.start_s + share * pointing.end_s)
                    rgb, _ = simulator.render_camera()
                    pose = person.hand_at(simulator.time_s - simulator.options.start_time_s)
                    true = eye.pixels(person.hand.joints @ pose[:3, :3].T + pose[:3, 3])
                    frames += 1
                    found = find.process(rgb).multi_hand_landmarks
                    if found:
                        marks = [np.array([[p.x * 640, p.y * 480] for p in hand.landmark]) for hand in found]
                        errors.append(min(_error_deg(m, true) for m in marks))
            simulator.close()
    logging.getLogger(__name__).info("found %d of %d, errors %s", len(errors), frames, np.round(errors, 1))
    assert frames == 6 * len(CASES)
    assert len(errors) >= 0.9 * frames
    assert np.median(errors) < 6.0
    assert np.quantile(errors, 0.9) < 10.0


def _error_deg(found, true):
    return _angle(
        found[HandLandmark.INDEX_TIP] - found[HandLandmark.INDEX_BASE],
        true[HandLandmark.INDEX_TIP] - true[HandLandmark.INDEX_BASE],
    )


def _angle(a, b):
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
