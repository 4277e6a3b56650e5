# SPDX-License-Identifier: Apache-2.0
"""Tasks live in odom; where the base stands, turned or not, does not change what is planned for."""

from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import lemon_and_bowl, make_task, robot, start_positions
from uncom_perception.types import Scene
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.base_approach import room_ahead
from uncom_tiago_exec.execution.task_planner import TaskPlanner, middle_places_in_odom
from uncom_tiago_exec.scene.base_frame import scene_in_odom, task_in_base, task_in_odom
from uncom_tiago_exec.scene.scene_model import build_scene
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.relay_via_middle import after_moving, middle_places
from uncom_tiago_exec.types import BasePose

POSES = [BasePose(), BasePose(0.118, 0.0, 0.0), BasePose(-1.3, 2.4, 0.7), BasePose(4.0, -0.5, -2.9)]


def exact(task):
    """The same task with clouds of double precision."""
    return task_with_clouds(task, np.float64)


def task_with_clouds(task, dtype):
    def widened(detection):
        geometry = replace(detection.geometry, cloud=np.asarray(detection.geometry.cloud, dtype=dtype))
        return replace(detection, geometry=geometry)

    target = None if task.target is None else widened(task.target)
    return replace(task, object=widened(task.object), target=target, scene=tuple(map(widened, task.scene)))


def numbers(task):
    """All that a task says of places, in one vector."""
    detections = (task.object, *task.scene, *(() if task.target is None else (task.target,)))
    parts = [part for d in detections for part in (d.geometry.cloud, d.geometry.pose, d.geometry.centroid)]
    parts += [task.table.polygon, task.table.normal]
    parts += [] if task.target_pose is None else [task.target_pose]
    return np.concatenate([np.asarray(part, dtype=float).ravel() for part in parts])


@pytest.mark.parametrize("base", POSES)
@pytest.mark.parametrize("seed", range(3))
def test_a_task_seen_from_anywhere_is_the_same_scene_before_the_robot(base, seed):
    things = lemon_and_bowl(np.random.default_rng(seed))
    for task in (make_task(things, "put_in", target="bowl"), make_task(things, "place", place=(0.6, 0.0))):
        here = exact(task)
        again = task_in_base(task_in_odom(here, base), base)
        assert np.abs(numbers(again) - numbers(here)).max() < 1e-9
        scene, other = build_scene(here), build_scene(again)
        assert other.table_z == pytest.approx(scene.table_z, abs=1e-9)
        for one, two in zip(scene.obstacles(with_moved=True), other.obstacles(with_moved=True), strict=True):
            assert one.name == two.name
            assert np.allclose(one.size, two.size, rtol=0.0, atol=1e-9)
            assert np.allclose(one.pose, two.pose, rtol=0.0, atol=1e-9)


def test_with_the_base_at_the_origin_not_a_bit_changes():
    task = make_task(lemon_and_bowl(np.random.default_rng(0)), "place", place=(0.6, 0.0))
    for same in (task_in_odom(task, BasePose()), task_in_base(task, BasePose())):
        assert np.array_equal(numbers(same), numbers(task))
        assert same.object.geometry.cloud.dtype == task.object.geometry.cloud.dtype


def test_what_stands_still_is_nearer_and_turned_from_a_base_that_drove_and_turned():
    task = make_task(lemon_and_bowl(np.random.default_rng(0), (0.6, 0.2)), "place", place=(0.6, 0.0))
    near = task_in_base(task, BasePose().driven(0.12))
    assert near.target_pose[:3, 3] == pytest.approx([0.48, 0.0, task.target_pose[2, 3]])
    assert room_ahead(near.table) == pytest.approx(room_ahead(task.table) - 0.12)
    turned = task_in_base(task, BasePose(0.0, 0.0, np.pi / 2.0))
    assert turned.target_pose[:2, 3] == pytest.approx([0.0, -0.6])
    assert BasePose(1.0, 2.0, np.pi / 2.0).driven(0.5) == BasePose(1.0, 2.5, np.pi / 2.0)
    assert BasePose(1.0, 2.0, 0.3).distance_ahead(BasePose(1.0, 2.0, 0.3).driven(-0.2)) == pytest.approx(-0.2)


def test_a_motion_in_the_base_frame_moves_a_thing_of_odom_as_far():
    base = BasePose(-1.3, 2.4, 0.7)
    here = exact(make_task(lemon_and_bowl(np.random.default_rng(0)), "place", place=(0.6, 0.0)))
    motion = BasePose(0.1, -0.3, 0.4).transform_base_to_odom
    moved = task_in_odom(after_moving(here, motion), base)
    also = after_moving(task_in_odom(here, base), base.motion_in_odom(motion))
    assert np.abs(numbers(moved) - numbers(also)).max() < 1e-9


def test_a_plan_is_the_same_wherever_in_odom_the_table_and_the_base_stand():
    base = BasePose(-1.3, 2.4, 0.7)
    here = exact(make_task(lemon_and_bowl(np.random.default_rng(0)), "put_in", target="bowl"))
    planner = ManipulationPlanner(robot(), ExecutionConfig())
    plan = planner.plan(here, start_positions())

    class Standing:
        def positions(self):
            return start_positions()

    there = TaskPlanner(planner, Standing()).plan(task_in_odom(here, base), base)
    assert there.base == base
    assert there.side == plan.side
    assert np.allclose(there.grasp.pose, plan.grasp.pose, atol=1e-6)
    assert np.allclose(there.motion, plan.motion, atol=1e-6)


def test_places_in_the_middle_are_before_the_robot_wherever_it_stands():
    base = BasePose(2.0, 0.5, 1.2)
    here = exact(make_task(lemon_and_bowl(np.random.default_rng(0), (0.6, 0.38)), "place", place=(0.6, -0.38)))
    places = middle_places(here)
    assert places
    expected = [base.transform_base_to_odom[:2] @ [*place, 0.0, 1.0] for place in places]
    assert np.allclose(middle_places_in_odom(task_in_odom(here, base), base), expected)


def test_a_scene_is_brought_to_odom_like_a_task():
    task = make_task(lemon_and_bowl(np.random.default_rng(0)), "pick")
    base = BasePose(0.3, -0.2, 0.5)
    scene = scene_in_odom(Scene(0.0, "base_footprint", task.scene, task.table, (), "test"), base)
    assert scene.frame_id == "odom"
    assert np.array_equal(
        numbers(replace(task_in_odom(task, base), scene=())),
        numbers(replace(task, object=scene.detections[0], scene=(), table=scene.table)),
    )
