# SPDX-License-Identifier: Apache-2.0
"""Shapes, grasps and places from clouds that a camera sees from one side."""

import numpy as np
import pytest
from exec_fixtures import TABLE_Z, ball_cloud, bowl_cloud, box_cloud, cylinder_cloud, make_task, robot
from uncom_sim.bench_planning.scenes import detection
from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.grasping.grasps import grasp_candidates
from uncom_tiago_exec.grasping.place_poses import destination, place_candidates
from uncom_tiago_exec.scene.object_shape import complete_shape
from uncom_tiago_exec.scene.obstacles import enclose_shape
from uncom_tiago_exec.scene.scene_model import build_scene

NOTHING = np.zeros((0, 3))


def grasps_of(shape, others=NOTHING):
    return grasp_candidates(shape, others, robot().gripper("left"))


@pytest.mark.parametrize(("radius", "height"), [(0.033, 0.115), (0.025, 0.2)])
def test_a_cylinder_is_completed_behind(radius, height):
    shape = complete_shape("can", cylinder_cloud(0.65, 0.1, radius, height, np.random.default_rng(0)), TABLE_Z)
    assert shape.axis is not None
    assert shape.rim is None
    assert np.linalg.norm(shape.middle[:2] - [0.65, 0.1]) < 0.006
    assert shape.axis.radius == pytest.approx(radius, abs=0.004)
    assert shape.height == pytest.approx(height, abs=0.006)


def test_a_bowl_is_hollow_and_a_ball_and_a_box_are_not():
    rng = np.random.default_rng(1)
    bowl = complete_shape("bowl", bowl_cloud(0.6, -0.1, 0.08, 0.065, rng), TABLE_Z)
    assert bowl.rim is not None
    assert bowl.rim.radius == pytest.approx(0.08, abs=0.006)
    assert np.linalg.norm(bowl.rim.centre - [0.6, -0.1]) < 0.006
    assert bowl.rim.floor_z < bowl.rim.z - 0.03
    assert complete_shape("ball", ball_cloud(0.6, 0.2, 0.036, rng), TABLE_Z).rim is None
    box = complete_shape("box", box_cloud(0.6, 0.2, 0.4, np.array([0.15, 0.08, 0.09]), rng), TABLE_Z)
    assert box.rim is None
    assert np.allclose(box.size, [0.15, 0.08, 0.09], atol=0.01)


def test_solids_hold_all_points():
    rng = np.random.default_rng(2)
    for cloud in (ball_cloud(0.6, 0.2, 0.036, rng), box_cloud(0.6, 0.2, 0.4, np.array([0.15, 0.08, 0.09]), rng)):
        shape = complete_shape("thing", cloud, TABLE_Z)
        held = np.zeros(len(cloud), dtype=bool)
        for solid in enclose_shape(shape):
            local = (cloud - solid.pose[:3, 3]) @ solid.pose[:3, :3]
            half = np.array(solid.size) / 2 + 0.003
            if solid.shape == "box":
                held |= (np.abs(local) <= half).all(axis=1)
            else:
                held |= (np.linalg.norm(local[:, :2], axis=1) <= half[0]) & (np.abs(local[:, 2]) <= half[2])
        assert held.mean() > 0.99


@pytest.mark.parametrize("yaw", [0.0, 0.5, 1.2, -0.8])
def test_a_box_is_taken_across_its_short_side(yaw):
    """A box too long for the gripper one way is gripped the other way, square to its sides."""
    cloud = box_cloud(0.6, 0.1, yaw, np.array([0.15, 0.06, 0.09]), np.random.default_rng(3))
    best = grasps_of(complete_shape("box", cloud, TABLE_Z))[0]
    short = np.array([-np.sin(yaw), np.cos(yaw)])
    assert abs(best.pose[:2, 1] @ short) > np.cos(np.radians(8))
    assert best.width == pytest.approx(0.06, abs=0.012)


def test_grasps_never_reach_into_the_table_and_never_open_too_wide():
    rng = np.random.default_rng(4)
    gripper = robot().gripper("left")
    clouds = [ball_cloud(0.6, 0.2, 0.03, rng), cylinder_cloud(0.6, 0.0, 0.03, 0.2, rng)]
    clouds += [box_cloud(0.6, 0.1, 0.3, np.array([0.18, 0.03, 0.01]), rng), bowl_cloud(0.6, 0.0, 0.08, 0.065, rng)]
    for cloud in clouds:
        grasps = grasps_of(complete_shape("thing", cloud, TABLE_Z))
        assert grasps
        for grasp in grasps:
            tip = grasp.pose[:3, 3] + gripper.tip * grasp.approach
            corner = tip[2] - gripper.half_width * abs(grasp.pose[2, 2])
            assert corner > TABLE_Z + 0.002
            assert grasp.width < grasp.opening <= gripper.open


def test_a_bowl_is_taken_by_its_edge():
    cloud = bowl_cloud(0.6, 0.0, 0.08, 0.065, np.random.default_rng(5))
    for grasp in grasps_of(complete_shape("bowl", cloud, TABLE_Z))[:10]:
        between = grasp.pose[:3, 3] + robot().gripper("left").tip * grasp.approach
        assert grasp.family == "rim"
        assert 0.05 < np.linalg.norm(between[:2] - [0.6, 0.0]) < 0.1


def test_neighbours_take_grasps_away():
    """With a wall close to both long sides, no finger goes between."""
    rng = np.random.default_rng(6)
    shape = complete_shape("box", box_cloud(0.6, 0.0, 0.0, np.array([0.15, 0.06, 0.09]), rng), TABLE_Z)
    walls = np.vstack([box_cloud(0.6, s * 0.045, 0.0, np.array([0.2, 0.02, 0.15]), rng) for s in (-1, 1)])
    assert grasps_of(shape)
    assert not grasps_of(shape, complete_shape("walls", walls, TABLE_Z).points)


def test_what_is_too_wide_has_no_grasp():
    cloud = box_cloud(0.6, 0.0, 0.0, np.array([0.15, 0.15, 0.09]), np.random.default_rng(7))
    assert not grasps_of(complete_shape("crate", cloud, TABLE_Z))


def test_put_in_lets_go_over_the_opening_with_fingers_above_the_rim():
    rng = np.random.default_rng(8)
    gripper = robot().gripper("left")
    things = [
        detection("lemon", ball_cloud(0.6, 0.2, 0.027, rng)),
        detection("bowl", bowl_cloud(0.6, -0.05, 0.08, 0.065, rng)),
    ]
    task = make_task(things, "put_in", target="bowl")
    scene = build_scene(task)
    goal = destination(task, scene.moved, scene.target, into=True)
    grasp = grasps_of(scene.moved, scene.neighbours)[0]
    for place in place_candidates(goal, scene.moved, grasp, gripper):
        middle = place.motion @ np.append(scene.moved.middle, 1.0)
        assert np.linalg.norm(middle[:2] - [0.6, -0.05]) < 0.01
        tip = place.hand[:3, 3] + gripper.tip * place.hand[:3, 0]
        assert tip[2] - gripper.half_width * abs(place.hand[2, 2]) > scene.target.rim.z + 0.005


def test_impossible_places_are_refused_in_words():
    rng = np.random.default_rng(9)
    things = [
        detection("ball", ball_cloud(0.6, 0.2, 0.036, rng)),
        detection("cup", bowl_cloud(0.6, -0.05, 0.03, 0.06, rng)),
    ]
    with pytest.raises(RefusedError, match="not on the table"):
        destination(
            make_task(things, "place", place=(0.6, 0.8)), *_shapes(make_task(things, "place", place=(0.6, 0.8)))
        )
    with pytest.raises(RefusedError, match="too wide"):
        destination(
            make_task(things, "put_in", target="cup"), *_shapes(make_task(things, "put_in", target="cup")), into=True
        )


def _shapes(task):
    scene = build_scene(task)
    return scene.moved, scene.target


def test_a_tall_thing_is_held_near_its_middle_and_carried_gently():
    """Far above its middle a bottle is a pendulum: the best grasps are not at its top."""
    rng = np.random.default_rng(11)
    shape = complete_shape("bottle", cylinder_cloud(0.6, 0.1, 0.03, 0.24, rng), TABLE_Z)
    gripper = robot().gripper("left")
    best = grasp_candidates(shape, np.zeros((0, 3)), gripper)[:10]
    pads = [g.pose[2, 3] + gripper.tip * g.approach[2] for g in best]
    assert max(pads) < shape.middle[2] + 0.08


@pytest.mark.parametrize("lean", [0.35, 0.55])
def test_a_hand_leans_along_the_wall_of_a_bowl_and_its_pads_lie_flat_on_it(lean):
    rng = np.random.default_rng(7)
    height, foot = 0.065, 0.055
    up, around = rng.uniform(0.0, height, 4000), rng.uniform(-np.pi, np.pi, 4000)
    radius = foot + up * np.tan(lean)
    wall = np.column_stack([0.6 + radius * np.cos(around), radius * np.sin(around), TABLE_Z + up])
    inside = np.sqrt(rng.uniform(0.0, foot**2, 1500))
    around = rng.uniform(-np.pi, np.pi, 1500)
    floor = np.column_stack([0.6 + inside * np.cos(around), inside * np.sin(around), np.full(1500, TABLE_Z + 0.008)])
    seen = wall[(wall[:, 0] > 0.6) | (wall[:, 2] > TABLE_Z + 0.5 * height)]
    shape = complete_shape("bowl", np.vstack([seen, floor]), TABLE_Z)
    best = grasps_of(shape)[0]
    assert best.family == "rim"
    outwards = best.pose[:2, 3] - shape.rim.centre
    normal = np.append(np.cos(lean) * outwards / np.linalg.norm(outwards), -np.sin(lean))
    assert abs(best.pose[:3, 1] @ normal) > np.cos(np.radians(15.0))
    gripper = robot().gripper("left")
    tip = best.pose[:3, 3] + gripper.tip * best.approach
    finger = 0.5 * best.opening + gripper.thickness
    assert tip[2] - finger * abs(best.pose[2, 1]) - gripper.half_width * abs(best.pose[2, 2]) > TABLE_Z


def test_what_is_longer_than_a_bowl_is_wide_goes_in_with_one_end():
    rng = np.random.default_rng(8)
    spoon = detection("spoon", box_cloud(0.55, 0.2, 0.3, np.array([0.19, 0.025, 0.012]), rng))
    bowl = detection("bowl", bowl_cloud(0.6, -0.1, 0.085, 0.065, rng))
    scene = build_scene(make_task([spoon, bowl], "put_in", target="bowl"))
    goal = destination(make_task([spoon, bowl], "put_in", target="bowl"), scene.moved, scene.target, into=True)
    grasp = grasps_of(scene.moved)[0]
    option = place_candidates(goal, scene.moved, grasp, robot().gripper("left"))[0]
    points = scene.moved.points @ option.motion[:3, :3].T + option.motion[:3, 3]
    rim = scene.target.rim
    low = points[points[:, 2].argmin()]
    assert np.linalg.norm(low[:2] - rim.centre) < 0.6 * rim.radius
    assert rim.floor_z < low[2] < rim.z - 0.03
    outside = np.linalg.norm(points[:, :2] - rim.centre, axis=1) > rim.radius - 0.01
    assert (points[outside, 2] > rim.z).all()
