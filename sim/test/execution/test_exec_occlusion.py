# SPDX-License-Identifier: Apache-2.0
"""The space behind things, which the camera does not see, is kept out of where there are other ways."""

from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import TABLE_Z, ball_cloud, box_cloud, cylinder_cloud, make_task, robot, start_positions
from uncom_sim.bench_planning.scenes import detection
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import MoveStep
from uncom_tiago_exec.scene.occlusion import find_occluded_space
from uncom_tiago_exec.scene.scene_model import build_scene
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner

CAMERA = np.array([0.2, 0.0, 1.35])


def scene_with(*things, target=None):
    lemon = detection("lemon", ball_cloud(0.55, 0.3, 0.027, np.random.default_rng(1)))
    return build_scene(make_task([lemon, *things], "place", place=(0.55, 0.1), target=target))


def inside(boxes, point):
    for box in boxes:
        local = box.pose[:3, :3].T @ (np.asarray(point) - box.pose[:3, 3])
        if (np.abs(local) <= 0.5 * np.array(box.size) + 1e-9).all():
            return True
    return False


@pytest.mark.parametrize("y", [-0.25, 0.0])
def test_what_a_tall_thing_hides_from_the_camera_is_in_its_shadow(y):
    """A low point is in the shadow where the line from the camera to it goes through the thing."""
    size = np.array([0.08, 0.14, 0.2])
    tall = detection("box", box_cloud(0.65, y, 0.0, size, np.random.default_rng(2)))
    boxes = find_occluded_space(scene_with(tall), CAMERA, None)
    assert boxes
    away = np.array([0.65, y]) - CAMERA[:2]
    ahead = away / np.linalg.norm(away)
    assert inside(boxes, [*(np.array([0.65, y]) + 0.1 * ahead), TABLE_Z + 0.03])
    assert not inside(boxes, [*(np.array([0.65, y]) - 0.1 * ahead), TABLE_Z + 0.03])
    assert not inside(boxes, [*(np.array([0.65, y]) + 0.1 * ahead), TABLE_Z + 0.23])
    assert not inside(boxes, [*(np.array([0.65, y]) + 0.5 * ahead), TABLE_Z + 0.03])


def test_low_things_and_the_surroundings_of_what_is_meant_have_no_shadow():
    rng = np.random.default_rng(3)
    low = detection("lid", box_cloud(0.65, -0.2, 0.0, np.array([0.1, 0.1, 0.04]), rng))
    assert find_occluded_space(scene_with(low), CAMERA, None) == ()
    can = detection("can", cylinder_cloud(0.62, -0.2, 0.033, 0.12, rng))
    behind = np.array([0.72, -0.24])
    assert find_occluded_space(scene_with(can), CAMERA, None)
    assert find_occluded_space(scene_with(can), CAMERA, behind) == ()


def test_motions_keep_out_of_what_is_not_seen_but_do_what_was_asked_for_there():
    rng = np.random.default_rng(4)
    lemon = detection("lemon", ball_cloud(0.58, 0.22, 0.027, rng))
    box = detection("box", box_cloud(0.6, 0.02, 0.2, np.array([0.06, 0.16, 0.22]), rng))
    planner = ManipulationPlanner(robot(), ExecutionConfig(planning_time_s=10.0))
    for place in ((0.56, -0.14), (0.72, 0.03)):  # past the box, and behind it
        task = make_task([lemon, box], "place", place=place)
        plan = planner.plan(task, start_positions())
        there = plan.motion @ np.append(plan.scene.moved.middle, 1.0)
        assert np.allclose(there[:2], place, atol=0.02)
        assert plan.scene.shadows == ()
    scene = build_scene(make_task([lemon, box], "place", place=(0.56, -0.14)))
    camera = robot().camera(start_positions())
    shadows = find_occluded_space(scene, camera, np.array([0.56, -0.14]))
    assert shadows
    plan = planner.plan(make_task([lemon, box], "place", place=(0.56, -0.14)), start_positions())
    careful = replace(scene, shadows=shadows)
    arm = ArmPlanner(robot(), plan.side, start_positions(), careful, ExecutionConfig(planning_time_s=10.0))
    free = arm.free_motion_checker(arm.start_gap)
    first = next(step.trajectory for step in plan.steps if isinstance(step, MoveStep))
    assert free.path_is_free(arm.group.clamp(first.positions))
