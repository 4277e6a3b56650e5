# SPDX-License-Identifier: Apache-2.0
"""The simulator repeats itself, hears and sees the person only while they are there, and knows what is touched."""

import numpy as np
import pytest
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.controllers.trajectory import Trajectory, Waypoint
from uncom_sim.driver.real_time import PeriodicSchedule
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.types import SAMPLE_RATE_HZ
from uncom_sim.world.microphone import Microphone
from uncom_sim.world.scene_file import scene_from_dict
from uncom_sim.world.simulator import Simulator

SCENE = {
    "objects": [
        {"id": "lemon_1", "kind": "lemon", "colour": "yellow", "x": 0.62, "y": 0.15},
        {"id": "bowl_1", "kind": "bowl", "colour": "red", "x": 0.70, "y": -0.2},
        {"id": "box_1", "kind": "cereal box", "colour": "blue", "x": 0.82, "y": 0.2},
    ],
    "say": "take the lemon",
    "point_object": "lemon_1",
    "point_target": None,
}


def _simulator(seed=4):
    return Simulator(scene_from_dict(SCENE), seed)


@pytest.fixture(scope="module")
def simulator():
    made = _simulator()
    yield made
    made.close()


def _run(simulator, seconds):
    for _ in range(round(seconds * 240)):
        simulator.step()


def test_things_rest_where_the_scene_puts_them_and_the_robot_touches_nothing(simulator):
    _run(simulator, 0.5)
    for state, thing in zip(simulator.object_states(), SCENE["objects"], strict=True):
        np.testing.assert_allclose(state.position[:2], (thing["x"], thing["y"]), atol=0.01)
    assert (simulator.contacts.table, simulator.contacts.bystanders) == (0, 0)


def test_the_head_camera_sees_each_thing_where_it_is(simulator):
    rgb, depth = simulator.render_camera()
    assert rgb.shape == (480, 640, 3)
    assert depth.shape == (480, 640)
    camera = simulator.robot.frame(CAMERA_FRAME)
    for state in simulator.object_states():
        point = camera[:3, :3].T @ (state.position - camera[:3, 3])
        u, v = HEAD_CAMERA.project([point])[0].round().astype(int)
        assert 0 <= u < 640
        assert 0 <= v < 480
        assert np.nanmedian(depth[v - 2 : v + 3, u - 2 : u + 3]) == pytest.approx(point[2], abs=0.12)
    assert np.isnan(depth).mean() < 0.1


def test_the_hand_is_in_the_picture_only_while_the_person_points(simulator):
    before, _ = simulator.render_camera()
    simulator.start_person()
    _run(simulator, 0.5 * simulator.world.person.duration_s)
    assert simulator.person_present
    during, _ = simulator.render_camera()
    assert (np.abs(during.astype(int) - before.astype(int)).max(axis=2) > 40).mean() > 0.02
    _run(simulator, 0.6 * simulator.world.person.duration_s)
    assert simulator.person_done
    after, _ = simulator.render_camera()
    assert (np.abs(after.astype(int) - before.astype(int)).max(axis=2) > 40).mean() < 0.002


def test_same_seed_and_commands_give_the_same_pictures_and_physics():
    pictures, positions = [], []
    for _ in range(2):
        simulator = _simulator()
        controller = simulator.controllers["head_controller"]
        _run(simulator, 0.1)
        goal = Trajectory(controller.config.joints, (Waypoint(0.3, np.array([0.2, -0.8])),))
        controller.start(goal, simulator.time_s)
        simulator.start_person()
        _run(simulator, 1.2)
        pictures.append(simulator.render_camera())
        positions.append(simulator.robot.readings.position)
        simulator.close()
    np.testing.assert_array_equal(pictures[0][0], pictures[1][0])
    np.testing.assert_array_equal(pictures[0][1], pictures[1][1])
    np.testing.assert_array_equal(*positions)


def test_an_arm_pushed_into_the_table_is_counted():
    simulator = _simulator()
    controller = simulator.controllers["arm_left_controller"]
    torso = simulator.controllers["torso_controller"]
    torso.start(Trajectory(torso.config.joints, (Waypoint(0.5, np.array([0.0])),)), simulator.time_s)
    reach = np.array([1.47, 1.3, 0.06, 0.3, -1.7, 0.0, 0.0])
    controller.start(Trajectory(controller.config.joints, (Waypoint(2.0, reach),)), simulator.time_s)
    _run(simulator, 4.0)
    assert simulator.contacts.table + simulator.contacts.bystanders > 0
    simulator.close()


def test_the_microphone_hears_a_quiet_room_then_the_voice_without_a_gap():
    voice = np.full(4000, 9000, np.int16)
    microphone = Microphone(voice, 10.0, seed=1)
    microphone.speak(10.5)
    chunks = []
    now = 10.0
    while now < 12.0:
        now += 1.0 / 240.0
        while (chunk := microphone.listen(now, 0.05)) is not None:
            chunks.append(chunk)
    stamps = np.array([stamp for stamp, _ in chunks])
    np.testing.assert_allclose(np.diff(stamps), 0.05, atol=1e-9)
    assert stamps[0] == 10.0
    sound = np.concatenate([samples for _, samples in chunks])
    start = round(0.5 * SAMPLE_RATE_HZ)
    assert np.abs(sound[:start]).max() < 60
    assert sound[:start].std() > 1.0
    assert sound[start : start + 4000].min() > 8000
    assert np.abs(sound[start + 4000 :]).max() < 60


def test_a_schedule_keeps_its_rate_and_can_change_it():
    schedule, fired = PeriodicSchedule(8.0, 10.0), []
    for i in range(480):
        now = 10.0 + i / 240.0
        if i == 240:
            schedule.set_rate(2.0, now)
        if schedule.due(now):
            fired.append(now)
    assert len([t for t in fired if t < 11.0]) == 8
    assert len([t for t in fired if t >= 11.0]) in (2, 3)
