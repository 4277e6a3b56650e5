# SPDX-License-Identifier: Apache-2.0
"""Pointing, holding out and pouring: where the hand goes, and what stays over what."""

from itertools import pairwise

import numpy as np
import pytest
from exec_fixtures import (
    TABLE_Z,
    ball_cloud,
    bowl_cloud,
    box_cloud,
    cylinder_cloud,
    make_task,
    robot,
    start_positions,
)
from uncom_common.primitive import Primitive
from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.run import run_case
from uncom_sim.bench_planning.scenes import detection
from uncom_sim.types import Meaning
from uncom_sim.world.scene_file import scene_from_dict
from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.collision.options import Margins
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import lean_angle
from uncom_tiago_exec.planning.plan import GripStep, MoveStep
from uncom_tiago_exec.scene.object_shape import complete_shape
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.pour import motions, mouth_edge
from uncom_tiago_exec.types import Stage


def planned(primitive, things):
    return ManipulationPlanner(robot(), ExecutionConfig()).plan(make_task(things, primitive), start_positions())


@pytest.mark.parametrize("y", [-0.2, 0.25])
def test_closed_fingers_point_at_the_thing_and_come_back(y):
    rng = np.random.default_rng(1)
    can = detection("can", cylinder_cloud(0.62, y, 0.033, 0.11, rng))
    plan = planned("point", [can, detection("apple", ball_cloud(0.7, -y, 0.035, rng))])
    out, back = (s.trajectory for s in plan.steps if isinstance(s, MoveStep))
    hand = robot().group(plan.side, start_positions()).forward(out.positions[-1])
    to_top = np.array([0.62, y, TABLE_Z + 0.11]) - hand[:3, 3]
    ahead = float(to_top @ hand[:3, 0])
    assert 0.05 < ahead < 0.35
    assert np.linalg.norm(to_top - ahead * hand[:3, 0]) < 0.015
    assert np.allclose(back.positions[-1], out.positions[0], atol=1e-3)
    assert next(s for s in plan.steps if isinstance(s, GripStep)).gap == 0.0


def test_what_is_given_is_held_out_high_over_the_table_and_kept():
    rng = np.random.default_rng(2)
    plan = planned("give", [detection("lemon", ball_cloud(0.58, 0.18, 0.027, rng))])
    last = plan.steps[-1]
    assert isinstance(last, MoveStep)
    assert last.stage == Stage.TRANSFERRING
    hand = robot().group(plan.side, start_positions()).forward(last.trajectory.positions[-1])
    assert hand[2, 3] > TABLE_Z + 0.2
    assert hand[0, 3] > 0.35
    assert not any(s.stage in (Stage.PLACING, Stage.HOMING) for s in plan.steps)


def test_the_mouth_stays_over_the_middle_while_everything_stays_above_it():
    rng = np.random.default_rng(3)
    mug = complete_shape("mug", cylinder_cloud(0.5, 0.2, 0.04, 0.1, rng), TABLE_Z)
    bowl = complete_shape("bowl", bowl_cloud(0.6, -0.05, 0.085, 0.065, rng), TABLE_Z)
    ahead = np.array([0.6, -0.8])
    edge = np.append(mouth_edge(mug, ahead), 1.0)
    for motion in motions(mug, bowl, ahead, 0.4, 2.0):
        at = motion @ edge
        assert np.linalg.norm(at[:2] - bowl.rim.centre) < 1e-6
        assert (mug.points @ motion[2, :3] + motion[2, 3]).min() > bowl.top + 0.04
    assert np.arccos(motions(mug, bowl, ahead, 0.4, 2.0)[-1][2, 2]) == pytest.approx(2.0)


def test_after_a_push_the_hand_goes_back_and_up_before_it_turns_away():
    """What was pushed may have turned, and a tall thing is not to be knocked over on the way home."""
    rng = np.random.default_rng(5)
    tall = detection("cereal box", box_cloud(0.55, 0.12, 0.3, np.array([0.15, 0.055, 0.215]), rng))
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(
        make_task([tall], "push", place=(0.59, 0.28)), start_positions()
    )
    along, out = (
        next(s.trajectory for s in plan.steps if isinstance(s, MoveStep) and s.stage == stage)
        for stage in (Stage.TRANSFERRING, Stage.RETREATING)
    )
    group = robot().group(plan.side, start_positions())
    way = group.forward(along.positions[-1])[:2, 3] - group.forward(along.positions[0])[:2, 3]
    before, after = (group.forward(out.positions[k])[:3, 3] for k in (0, -1))
    assert (after - before)[:2] @ way / np.linalg.norm(way) < -0.025
    assert after[2] - before[2] > 0.07


def test_a_wide_dish_that_is_to_be_held_is_lifted_so_high_that_it_may_hang_down():
    rng = np.random.default_rng(3)
    plan = planned("pick", [detection("bowl", bowl_cloud(0.58, 0.2, 0.085, 0.065, rng))])
    lift = next(s.trajectory for s in plan.steps if isinstance(s, MoveStep) and s.stage == Stage.LIFTING)
    group = robot().group(plan.side, start_positions())
    assert (group.forward(lift.positions[-1]) - group.forward(lift.positions[0]))[2, 3] > 1.6 * 0.085


@pytest.mark.parametrize("primitive", ["pour", "place", "put_in", "give", "push", "point"])
def test_each_motion_begins_where_the_one_before_ended(primitive):
    """Arms would be thrown from one to the other."""
    for seed, (x, y) in enumerate([(0.55, 0.25), (0.6, -0.22)]):
        rng = np.random.default_rng(seed)
        can = detection("can", cylinder_cloud(x, y, 0.03, 0.1, rng))
        bowl = detection("bowl", bowl_cloud(0.62, 0.0, 0.085, 0.065, rng))
        target = "bowl" if primitive in ("pour", "put_in") else None
        place = (x, 1.45 * y) if primitive in ("place", "push") else (x, y) if primitive == "pour" else None
        task = make_task([can, bowl], primitive, target=target, place=place)
        plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(task, start_positions())
        moves = [s.trajectory for s in plan.steps if isinstance(s, MoveStep)]
        for before, after in pairwise(moves):
            assert np.abs(after.positions[0] - before.positions[-1]).max() < 0.02


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_mug_is_tilted_over_a_bowl_and_stands_again_where_it_was():
    things = [{"id": "o0", "kind": "mug", "x": 0.55, "y": 0.25, "yaw": 0.4}]
    things.append({"id": "o1", "kind": "bowl", "x": 0.58, "y": 0.0, "yaw": 0.0})
    scene = scene_from_dict({"objects": things, "say": "pour it"})
    run = run_case(
        Case(0, scene, Meaning("o0", "area", "o1", (0.55, 0.25)), "pour", Primitive.POUR, None), robot=robot()
    )
    assert run.outcome.success, run.outcome.reason
    assert run.physical.success, run.physical.reason
    assert run.physical.object_moved_m < 0.03
    assert run.physical.others_moved_m < 0.02
    assert run.table_touches == 0


@pytest.mark.parametrize(("x", "y"), [(0.55, 0.25), (0.62, -0.1)])
def test_fingers_keep_well_off_the_table_on_free_ways(x, y):
    """Straight ways to a thing lead as near as they must; on the ways before and after nothing is gained by that."""
    rng = np.random.default_rng(11)
    lemon = detection("lemon", ball_cloud(x, y, 0.027, rng))
    box = detection("box", box_cloud(0.7, 0.12, 0.3, np.array([0.12, 0.09, 0.08]), rng))
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(
        make_task([lemon, box], "place", place=(0.56, -0.22 if y > 0 else 0.02)), start_positions()
    )
    arm = ArmPlanner(robot(), plan.side, start_positions(), plan.scene, ExecutionConfig())
    free = [
        s.trajectory for s in plan.steps if isinstance(s, MoveStep) and s.detail.startswith(("to the o", "back to"))
    ]
    assert len(free) == 2
    table = CollisionChecker(arm.group, (plan.scene.table,), Margins(scene=0.009, fingers=0.0075, body=0.0))
    for motion in free:
        assert table.path_is_free(arm.group.clamp(motion.positions))


def test_a_free_way_may_begin_nearer_to_things_than_it_goes_on():
    """Where fingers were left 5 mm over the table is no collision."""
    rng = np.random.default_rng(12)
    plan = planned("pick", [detection("lemon", ball_cloud(0.58, 0.2, 0.027, rng))])
    arm = ArmPlanner(robot(), plan.side, start_positions(), plan.scene, ExecutionConfig())
    free = arm.free_motion_checker(arm.start_gap)
    home = arm.group.clamp(arm.start)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]
    pose[:3, 3] = 0.5, 0.3 if plan.side == "left" else -0.3, plan.scene.table_z + arm.group.gripper.tip + 0.005
    low = arm.solver.solutions(pose, [home], restarts=20)[0]
    assert not free.is_free(low)
    way = arm.transit(free, low, [home])
    assert np.allclose(way[0], low)
    assert np.allclose(way[-1], home)
    pose[2, 3] -= 0.02  # in the table
    with pytest.raises(RefusedError):
        arm.transit(arm.free_motion_checker(arm.start_gap), arm.solver.solutions(pose, [home], restarts=20)[0], [home])


@pytest.mark.parametrize(("x", "y"), [(0.55, 0.25), (0.6, -0.22), (0.5, 0.1)])
def test_nothing_is_spilled_on_the_way_to_the_target_and_back(x, y):
    rng = np.random.default_rng(13)
    can = detection("can", cylinder_cloud(x, y, 0.03, 0.1, rng))
    bowl = detection("bowl", bowl_cloud(0.64, 0.02 if y < 0 else -0.08, 0.085, 0.065, rng))
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(
        make_task([can, bowl], "pour", target="bowl", place=(x, y)), start_positions()
    )
    arm = ArmPlanner(robot(), plan.side, start_positions(), plan.scene, ExecutionConfig())
    ways = [s for s in plan.steps if isinstance(s, MoveStep) and s.detail in ("to over the target", "to the place")]
    assert len(ways) == 2
    for step in ways:
        assert max(lean_angle(arm, plan.grasp, q) for q in step.trajectory.positions) < np.radians(60.0)
