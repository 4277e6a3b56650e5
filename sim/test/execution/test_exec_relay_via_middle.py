# SPDX-License-Identifier: Apache-2.0
"""What one arm cannot bring all the way goes by the middle of the table."""

from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import ObedientRobot, ball_cloud, cylinder_cloud, make_task, robot
from uncom_common.primitive import Primitive
from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.run import run_case
from uncom_sim.bench_planning.scenes import detection
from uncom_sim.types import Meaning
from uncom_sim.world.scene_file import scene_from_dict
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import UnreachableError
from uncom_tiago_exec.execution.base_approach import BaseApproach
from uncom_tiago_exec.execution.task_planner import TaskPlanner
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.scene.scene_model import build_scene
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.relay_via_middle import after_moving, middle_places, to_middle


def lemon_far_from_its_place(*others):
    rng = np.random.default_rng(2)
    things = [detection("lemon", ball_cloud(0.6, 0.38, 0.027, rng))]
    things += [detection(f"can{i}", cylinder_cloud(x, y, 0.033, 0.11, rng)) for i, (x, y) in enumerate(others)]
    return make_task(things, "place", place=(0.6, -0.38))


def test_places_in_the_middle_are_free_and_on_the_table():
    cans = [(0.6, 0.0), (0.52, 0.12)]
    places = middle_places(lemon_far_from_its_place(*cans))
    assert places
    for place in places:
        assert abs(place[1]) < 0.2
        assert all(np.linalg.norm(place - can) > 0.033 + 0.027 for can in cans)


def test_the_second_half_begins_where_the_first_one_ends():
    task = lemon_far_from_its_place()
    half = to_middle(task, np.array([0.55, 0.0]))
    assert half.target is None
    motion = make_upright_pose(np.array([-0.05, -0.38, 0.0]), 0.0)
    rest = after_moving(task, motion)
    assert rest.primitive == task.primitive
    assert np.allclose(rest.target_pose, task.target_pose)
    assert rest.object.geometry.centroid[:2] == pytest.approx([0.55, 0.0], abs=0.02)
    assert not any(d.id == "lemon" for d in rest.scene)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_can_goes_from_one_end_of_the_table_to_the_other_by_both_arms():
    objects = [{"id": "o0", "kind": "can", "x": 0.66, "y": 0.33, "yaw": 0.0}]
    objects.append({"id": "o1", "kind": "apple", "x": 0.8, "y": 0.1, "yaw": 0.0})
    scene, place = scene_from_dict({"objects": objects, "say": "take it"}), (0.66, -0.33)
    run = run_case(Case(0, scene, Meaning("o0", "area", None, place), "area", Primitive.PLACE, place), robot=robot())
    assert run.outcome.success, run.outcome.reason
    assert run.physical.success, run.physical.reason
    assert {s.arm for s in run.told if s.arm} == {"left", "right"}
    assert run.table_touches == 0
    assert run.home_error < 0.02


def test_where_it_has_to_drive_anyhow_it_drives_to_where_it_can_take_hold_well():
    """A plan with a doubtful grasp from nearer is left for a much better one from nearer still."""

    class Plans(ManipulationPlanner):
        def plan(self, task, positions, avoid=(), like=None):
            ahead = round(float(0.9 - np.mean(task.object.geometry.cloud[:, 0])), 2)
            quality = {0.06: self.qualities[0], 0.12: self.qualities[1]}.get(ahead)
            if quality is None:
                raise UnreachableError("object")
            return Plan("left", (), build_scene(task), Grasp(np.eye(4), 0.02, 0.05, 0.1, quality, "across"))

    can = detection("can", cylinder_cloud(0.9, 0.2, 0.03, 0.1, np.random.default_rng(1)))
    cloud = np.asarray(can.geometry.cloud)
    cloud = (cloud + np.array([0.9 - cloud[:, 0].mean(), 0.0, 0.0])).astype(np.float32)
    can = replace(can, geometry=replace(can.geometry, cloud=cloud))
    planner = Plans(robot(), ExecutionConfig())
    machine = ObedientRobot(None, [0.06])
    approach = BaseApproach(TaskPlanner(planner, machine), machine, ExecutionConfig())
    for planner.qualities, expected in (((0.1, 0.5), 0.12), ((0.1, 0.12), 0.06), ((0.4, 0.9), 0.06)):
        found = approach.find_plan(make_task([can], "pick"), 1)
        assert found[0] == expected
