# SPDX-License-Identifier: Apache-2.0
"""Whole plans, and the engine on a robot that does what it is told."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from exec_fixtures import (
    DrivingRobot,
    LookingOn,
    ObedientRobot,
    ball_cloud,
    box_cloud,
    cylinder_cloud,
    dish_cloud,
    lemon_and_bowl,
    make_task,
    robot,
    start_positions,
)
from uncom_perception.types import Scene
from uncom_sim.bench_planning.scenes import detection, flat_table
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError, RefusedError, UnreachableError
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.observation.verification import verify
from uncom_tiago_exec.planning.plan import GripStep, MoveStep
from uncom_tiago_exec.scene.base_frame import task_in_base
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.trajectory.trajectory_edits import reversed_trajectory
from uncom_tiago_exec.types import Stage

CONFIG = ExecutionConfig()


@pytest.fixture(scope="module")
def plan():
    task = make_task(lemon_and_bowl(np.random.default_rng(0)), "put_in", target="bowl")
    return ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())


def test_a_plan_is_one_unbroken_motion_from_the_start_back_to_it(plan):
    moves = [s for s in plan.steps if isinstance(s, MoveStep)]
    home = np.array([start_positions()[n] for n in moves[0].trajectory.joint_names])
    assert np.allclose(moves[0].trajectory.positions[0], home, atol=0.006)
    assert np.allclose(moves[-1].trajectory.positions[-1], home, atol=1e-9)
    for a, b in pairwise(moves):
        assert np.allclose(a.trajectory.positions[-1], b.trajectory.positions[0], atol=1e-6)


def test_a_plan_keeps_the_joints_limits(plan):
    group = robot().group(plan.side, start_positions())
    for step in plan.steps:
        if isinstance(step, MoveStep):
            assert (np.abs(step.trajectory.velocities) <= np.array(group.velocity) * CONFIG.speed * 1.001).all()
            assert (step.trajectory.positions >= np.array(group.model.lowerPositionLimit) - 1e-6).all()
            assert (step.trajectory.positions <= np.array(group.model.upperPositionLimit) + 1e-6).all()


def test_stages_come_in_order(plan):
    stages = [step.stage for step in plan.steps]
    assert stages == sorted(stages)
    assert [s.stage for s in plan.steps if isinstance(s, GripStep) and s.holding] == [Stage.GRASPING]


def test_a_whole_plan_is_found_quickly(plan):
    """Within a few seconds of processor time, however busy the machine."""
    assert sum(plan.timings_s.values()) < 6.0


def test_out_of_reach_is_said_before_anything_moves():
    rng = np.random.default_rng(1)
    far = make_task(lemon_and_bowl(rng, lemon=(1.6, 0.0)), "pick")
    with pytest.raises(UnreachableError, match="out of reach"):
        ManipulationPlanner(robot(), CONFIG).plan(far, start_positions())


def test_without_a_table_nothing_is_planned():
    task = make_task(lemon_and_bowl(np.random.default_rng(2)), "pick")
    blind = type(task)(**{**{f: getattr(task, f) for f in task.__slots__}, "table": None})
    with pytest.raises(RefusedError, match="do not see the table"):
        ManipulationPlanner(robot(), CONFIG).plan(blind, start_positions())


def run(widths, after=None, stop_at=None, primitive="put_in"):
    things = lemon_and_bowl(np.random.default_rng(0))
    moved = [
        detection("lemon", ball_cloud(0.6, -0.08, 0.027, np.random.default_rng(1)) + np.array([0, 0, 0.01])),
        *things[1:],
    ]
    scene = Scene(0.0, "base_footprint", tuple(moved if after is None else after), flat_table(), (), "test")
    told = []
    machine = ObedientRobot(scene, widths, stop_at)
    engine = Engine(robot(), machine, CONFIG, told.append)
    outcome = engine.execute(make_task(things, primitive, target="bowl"))
    return outcome, told, machine


def test_the_engine_goes_through_all_stages_and_ends_done():
    outcome, told, machine = run([0.05])
    stages = [s.stage for s in told]
    assert outcome.success, outcome.reason
    assert stages[-1] == Stage.DONE
    assert stages == sorted(stages)
    assert {Stage.PLANNING, Stage.GRASPING, Stage.LIFTING, Stage.PLACING, Stage.HOMING, Stage.VERIFYING} <= set(stages)
    start = start_positions()
    assert all(abs(machine.joints[n] - v) < 1e-6 for n, v in start.items() if "finger" not in n)


def test_an_empty_grasp_is_noticed_and_tried_another_way():
    things = lemon_and_bowl(np.random.default_rng(0))
    outcome, told, machine = run([0.0], after=things)
    assert not outcome.success
    assert "closed beside the lemon" in outcome.reason
    poses = [s.data["grasp"]["pose"] for s in told if "grasp" in s.data]
    assert len(poses) == CONFIG.grasp_attempts
    assert all(not np.allclose(a, b, atol=0.01) for a, b in pairwise(poses))
    assert all(abs(machine.joints[n] - v) < 0.01 for n, v in start_positions().items() if "finger" not in n)


def test_a_thing_that_stays_where_it_was_is_a_failure():
    outcome, _, _ = run([0.05], after=lemon_and_bowl(np.random.default_rng(0)))
    assert not outcome.success
    assert "still where it was" in outcome.reason


def test_a_stop_ends_in_stopped_with_the_thing_in_hand():
    outcome, told, _ = run([0.05], stop_at=5)
    assert told[-1].stage == Stage.STOPPED
    assert outcome.in_hand == "lemon"


def test_a_command_that_names_no_action_is_refused_politely():
    outcome, _, machine = run([0.05], primitive="none")
    assert not outcome.success
    assert "not told what to do" in outcome.reason
    assert machine.moves == 0


def test_a_reversed_motion_is_the_same_motion_backwards(plan):
    motion = next(s.trajectory for s in plan.steps if isinstance(s, MoveStep))
    back = reversed_trajectory(motion)
    assert back.times[0] == 0.0
    assert np.allclose(back.positions[0], motion.positions[-1])
    assert np.allclose(back.velocities[1], -motion.velocities[-2])


def test_after_a_fault_the_arm_goes_home_with_what_it_holds():
    """A controller that gives up on the way to the place leaves the robot at its start, still holding."""

    class Faulty(ObedientRobot):
        def follow(self, trajectory):
            super().follow(trajectory)
            if self.moves == 4:
                raise MotionError("arm_left_controller gave up: test")

    things = lemon_and_bowl(np.random.default_rng(0))
    machine = Faulty(Scene(0.0, "base_footprint", tuple(things), flat_table(), (), "test"), [0.05])
    outcome = Engine(robot(), machine, CONFIG, lambda _: None).execute(make_task(things, "put_in", target="bowl"))
    assert not outcome.success
    assert outcome.in_hand == "lemon"
    assert "gave up" in outcome.reason
    start = start_positions()
    assert all(abs(machine.joints[n] - v) < 0.01 for n, v in start.items() if "finger" not in n)


def test_a_flat_dish_is_pushed_straight_to_its_place():
    """No pinch of a low border holds a plate: two fingers go down behind it and along the straight line."""
    rng = np.random.default_rng(3)
    plate = detection("plate", dish_cloud(0.6, -0.2, 0.11, 0.02, rng))
    task = make_task(
        [plate, detection("can", cylinder_cloud(0.72, 0.3, 0.033, 0.11, rng))], "place", place=(0.62, -0.02)
    )
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    assert plan.grasp is None
    push = next(s.trajectory for s in plan.steps if isinstance(s, MoveStep) and s.stage == Stage.TRANSFERRING)
    group = robot().group(plan.side, start_positions())
    hands = np.array([group.forward(q)[:3, 3] for q in push.positions])
    way = hands[-1] - hands[0]
    along = (hands - hands[0]) @ way / np.linalg.norm(way)
    beside = hands - hands[0] - along[:, None] * way / np.linalg.norm(way)
    assert np.abs(beside).max() < 0.004
    assert way[:2] / np.linalg.norm(way) == pytest.approx([0.11, 0.99], abs=0.03)
    assert np.linalg.norm(way) == pytest.approx(np.hypot(0.02, 0.18) + 0.025, abs=0.01)


def test_a_push_against_something_else_is_refused():
    rng = np.random.default_rng(4)
    things = [
        detection("plate", dish_cloud(0.6, -0.2, 0.11, 0.02, rng)),
        detection("can", cylinder_cloud(0.61, -0.03, 0.033, 0.11, rng)),
    ]
    with pytest.raises(RefusedError, match="in the way"):
        ManipulationPlanner(robot(), CONFIG).plan(make_task(things, "place", place=(0.62, 0.1)), start_positions())


def test_what_was_picked_up_can_be_set_down_by_the_next_command():
    """The first command leaves the lemon in the hand; the second brings it to the bowl and the arm to the start."""
    things = lemon_and_bowl(np.random.default_rng(0))
    in_bowl = ball_cloud(0.6, -0.08, 0.027, np.random.default_rng(1)) + np.array([0, 0, 0.01])
    after = [detection("lemon", in_bowl), *things[1:]]
    machine = ObedientRobot(Scene(0.0, "base_footprint", tuple(after), flat_table(), (), "test"), [0.05])
    engine = Engine(robot(), machine, CONFIG, lambda _: None)
    first = engine.execute(make_task(things, "pick"))
    assert first.success
    assert first.in_hand == "lemon"
    other = engine.execute(make_task([things[2], *things[:2]], "put_in", target="bowl"))
    assert not other.success
    assert "I hold the lemon" in other.reason
    second = engine.execute(make_task(things, "put_in", target="bowl"))
    assert second.success, second.reason
    assert second.in_hand == ""
    assert all(abs(machine.joints[n] - v) < 0.01 for n, v in start_positions().items() if "finger" not in n)


def test_after_a_stop_the_next_command_begins_with_going_home():
    things = lemon_and_bowl(np.random.default_rng(0))
    in_bowl = ball_cloud(0.6, -0.08, 0.027, np.random.default_rng(1)) + np.array([0, 0, 0.01])
    after = [detection("lemon", in_bowl), *things[1:]]
    scenes = [Scene(0.0, "base_footprint", tuple(seen), flat_table(), (), "test") for seen in (things, after)]
    machine = LookingOn(scenes, [0.05] * 3)
    machine.stop_at = 2
    engine = Engine(robot(), machine, CONFIG, lambda _: None)
    assert engine.execute(make_task(things, "put_in", target="bowl")).stage != Stage.DONE
    away = max(abs(machine.joints[n] - v) for n, v in start_positions().items() if "finger" not in n)
    assert away > 0.1
    machine.stop_at = None
    outcome = engine.execute(make_task(things, "put_in", target="bowl"))
    assert outcome.success, outcome.reason
    assert all(abs(machine.joints[n] - v) < 0.01 for n, v in start_positions().items() if "finger" not in n)


class ShortArmed(DrivingRobot):
    """Sees everything that much nearer as it has driven."""

    def look(self):
        seen = make_task(list(self.scene.detections), "pick")
        near = task_in_base(seen, self.base)
        return replace(super().look(), detections=near.scene, table=near.table)


def test_what_is_out_of_reach_is_reached_by_driving_nearer_and_back():
    rng = np.random.default_rng(5)
    can = detection("can", cylinder_cloud(0.93, 0.2, 0.033, 0.11, rng))
    machine = ShortArmed(Scene(0.0, "base_footprint", (can,), flat_table(), (), "test"), [0.066])
    outcome = Engine(robot(), machine, CONFIG, lambda _: None).execute(make_task([can], "pick"))
    assert outcome.success, outcome.reason
    assert machine.driven[0] > 0.0
    assert machine.base.x == pytest.approx(0.0, abs=1e-9)
    fixed = ShortArmed(Scene(0.0, "base_footprint", (can,), flat_table(), (), "test"), [0.066])
    refused = Engine(robot(), fixed, replace(CONFIG, drive_base=False), lambda _: None).execute(
        make_task([can], "pick")
    )
    assert not refused.success
    assert not fixed.driven
    assert fixed.moves == 0


def test_what_fell_beside_its_target_is_not_on_it():
    """The box still stands where the can was to be; only the height tells that the can is not there."""
    rng = np.random.default_rng(6)
    can = detection("can", cylinder_cloud(0.6, 0.25, 0.033, 0.11, rng))
    box = detection("box", box_cloud(0.62, 0.0, 0.2, np.array([0.12, 0.09, 0.08]), rng))
    task = make_task([can, box], "stack", target="box", relation="on")
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    fallen = detection("can", cylinder_cloud(0.55, 0.14, 0.033, 0.07, rng))
    stacked = cylinder_cloud(*plan.scene.target.middle[:2], 0.033, 0.11, rng)
    stacked[:, 2] += 0.08
    on_top = detection("can", stacked)
    for thing, expected in ((fallen, False), (on_top, True)):
        seen = Scene(0.0, "base_footprint", (thing, box), flat_table(), (), "test")
        assert verify(task, plan, seen, on_target=True).success is expected


def test_what_slipped_out_of_a_doubtful_grasp_is_pushed():
    rng = np.random.default_rng(1)
    task = make_task([detection("pan", dish_cloud(0.58, -0.2, 0.09, 0.05, rng))], "place", place=(0.6, -0.02))
    planner = ManipulationPlanner(robot(), CONFIG)
    first = planner.plan(task, start_positions())
    assert first.grasp is not None
    second = planner.plan(task, start_positions(), [first.grasp.pose])
    assert second.grasp is None
    assert second.motion[:2, 3] == pytest.approx([0.02, 0.18], abs=0.02)


def test_what_is_too_heavy_for_a_pinch_of_its_edge_is_pushed_at_once():
    rng = np.random.default_rng(1)
    task = make_task([detection("pan", dish_cloud(0.58, -0.2, 0.12, 0.045, rng))], "place", place=(0.6, -0.02))
    assert ManipulationPlanner(robot(), CONFIG).plan(task, start_positions()).grasp is None
