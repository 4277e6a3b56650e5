# SPDX-License-Identifier: Apache-2.0
"""What an earlier command left: an arm over the table, a thing in the hand, things that the arm hides."""

from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import (
    DrivingRobot,
    LookingOn,
    ball_cloud,
    cylinder_cloud,
    lemon_and_bowl,
    make_task,
    robot,
    start_positions,
)
from uncom_perception.types import Scene
from uncom_sim.bench_planning.scenes import detection, flat_table
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError, RefusedError, UnreachableError
from uncom_tiago_exec.execution.base_driver import BaseDriver
from uncom_tiago_exec.execution.behaviours import Action, Recovery
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.execution.execution_state import ExecutionState, PlanUnderWay
from uncom_tiago_exec.execution.execution_tree import there_and_back
from uncom_tiago_exec.execution.plan_executor import PlanExecutor
from uncom_tiago_exec.execution.recovery import InterruptedArm, plan_way_home
from uncom_tiago_exec.execution.task_actions import TaskActions
from uncom_tiago_exec.observation.object_reidentification import update_task_unobstructed
from uncom_tiago_exec.observation.robot_segmentation import robot_boxes, task_with_held_object
from uncom_tiago_exec.planning.plan import MoveStep
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.relay_via_middle import middle_places
from uncom_tiago_exec.types import Stage


def held_up_at_home_too():
    """A robot whose arm is held up on its way to the thing, and again when it goes back, and then no more."""

    class HeldUp(LookingOn):
        def follow(self, trajectory):
            super().follow(trajectory)
            if self.moves in (2, 3):
                halfway = trajectory.positions[len(trajectory.times) // 2]
                self.joints |= dict(zip(trajectory.joint_names, halfway, strict=True))
                raise MotionError("arm_left_controller gave up: path tolerance")

    return HeldUp


def scene_of(things):
    return Scene(0.0, "base_footprint", tuple(things), flat_table(), (), "test")


def test_an_arm_that_could_not_go_home_goes_home_first_when_the_next_command_comes():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = held_up_at_home_too()([scene_of(things)], [0.05])
    engine = Engine(robot(), machine, ExecutionConfig(verify=False), lambda _: None)
    first = engine.execute(make_task(things, "put_in", target="bowl"))
    assert not first.success
    assert max(abs(machine.joints[n] - v) for n, v in start_positions().items() if "finger" not in n) > 0.1
    second = engine.execute(make_task(things, "put_in", target="bowl"))
    assert second.success, second.reason
    assert all(abs(machine.joints[n] - v) < 0.01 for n, v in start_positions().items() if "finger" not in n)


@pytest.fixture(scope="module")
def picked():
    """A task, its plan, and the joints with the lemon lifted."""
    things = lemon_and_bowl(np.random.default_rng(0))
    task = make_task(things, "pick")
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(task, start_positions())
    lifted = [step.trajectory for step in plan.steps if isinstance(step, MoveStep)][-1]
    joints = {**start_positions(), **dict(zip(lifted.joint_names, lifted.positions[-1], strict=True))}
    return task, plan, joints


def test_what_is_seen_of_the_hand_and_of_what_it_holds_is_the_robot_itself(picked):
    task, plan, joints = picked
    group = robot().group(plan.side, joints)
    hand = group.forward(group.vector(joints))
    rng = np.random.default_rng(3)
    palm = hand[:3, 3] - 0.06 * hand[:3, 0]
    palm_seen = detection("egg", palm + rng.uniform(-0.02, 0.02, (200, 3)))
    middle = np.append(plan.scene.moved.middle, 1.0)
    lemon_now = (hand @ np.linalg.inv(plan.grasp.pose) @ middle)[:3]
    lemon_seen = detection("lemon", lemon_now + 0.4 * rng.uniform(-0.05, 0.05, (200, 3)))
    seen = (palm_seen, lemon_seen, *task.scene[1:])
    own = robot_boxes(robot(), joints, plan)
    assert own.among(seen) == {"egg", "lemon"}
    assert robot_boxes(robot(), joints).among(task.scene) == set()


def test_with_a_thing_in_the_hand_all_others_stay_where_they_are_the_named_and_the_hidden_too(picked):
    before, *_ = picked
    lemon, bowl, box = before.scene
    can = detection("can", cylinder_cloud(0.55, -0.3, 0.033, 0.11, np.random.default_rng(4)))
    seen = replace(before, object=can, scene=(can, box))  # the arm hides the bowl
    task = task_with_held_object(seen, before, frozenset())
    assert task.object.geometry is lemon.geometry
    places = {thing.id for thing in task.scene}
    assert places == {"can", "box", "hidden bowl"}
    again = task_with_held_object(replace(seen, scene=(can, bowl, box)), before, frozenset())
    assert {thing.id for thing in again.scene} == {"can", "bowl", "box"}
    cloud = np.asarray(bowl.geometry.cloud)
    half = detection("cup", cloud[cloud[:, 1] > np.median(cloud[:, 1])])
    beside = task_with_held_object(replace(seen, scene=(can, half, box)), before, frozenset())
    assert {thing.id for thing in beside.scene} == {"can", "cup", "box", "hidden bowl"}


def test_what_was_taken_low_over_the_table_can_be_set_down_again():
    """The lowest points that are seen of a thing are a little above the table; the hand comes no lower for that."""
    rng = np.random.default_rng(5)
    cup = cylinder_cloud(0.66, -0.16, 0.036, 0.08, rng)
    cup = cup[cup[:, 2] > cup[:, 2].min() + 0.004]
    things = [detection("cup", cup), detection("apple", ball_cloud(0.6, -0.36, 0.035, rng))]
    planner = ManipulationPlanner(robot(), ExecutionConfig())
    plan = planner.plan(make_task(things, "pick"), start_positions())
    lifted = [step.trajectory for step in plan.steps if isinstance(step, MoveStep)][-1]
    joints = {**start_positions(), **dict(zip(lifted.joint_names, lifted.positions[-1], strict=True))}
    placing = planner.plan_held(make_task(things, "place", place=(0.55, -0.15)), joints, plan)
    lowest = [step.trajectory for step in placing.steps if isinstance(step, MoveStep) and step.stage == Stage.PLACING]
    group = robot().group(plan.side, joints)
    assert group.forward(lowest[-1].positions[-1])[2, 3] > plan.grasp.pose[2, 3] - 1e-4


def test_in_a_crowded_middle_there_is_still_a_place_for_what_one_arm_cannot_bring_all_the_way():
    rng = np.random.default_rng(6)
    things = [detection("cup", cylinder_cloud(0.65, -0.28, 0.04, 0.08, rng))]
    taken = [(0.65, 0.15), (0.64, -0.11), (0.51, 0.04)]
    for i, (x, y) in enumerate(taken):
        things.append(detection(f"can{i}", cylinder_cloud(x, y, 0.035, 0.11, rng)))
    places = middle_places(make_task(things, "place", place=(0.54, 0.28)))
    assert places
    for place in places:
        assert abs(place[1]) < 0.2
        assert all(
            np.linalg.norm(place - xy) > 0.035 + 0.04 + 0.02 for xy in [(0.65, 0.15), (0.64, -0.11), (0.51, 0.04)]
        )


def test_from_around_a_tall_thing_just_let_go_the_hand_goes_back_along_its_fingers():
    """Straight up it would still be around the thing."""
    rng = np.random.default_rng(7)
    things = [detection("bottle", cylinder_cloud(0.6, 0.2, 0.033, 0.24, rng))]
    planner = ManipulationPlanner(robot(), ExecutionConfig())
    plan = planner.plan(make_task(things, "place", place=(0.6, 0.0)), start_positions())
    lower = next(step.trajectory for step in plan.steps if isinstance(step, MoveStep) and step.stage == Stage.PLACING)
    half = 0.5 * plan.grasp.width + 0.001  # the fingers have hardly opened
    fingers = {f"gripper_{plan.side}_{finger}_finger_joint": half for finger in ("left", "right")}
    joints = {**start_positions(), **dict(zip(lower.joint_names, lower.positions[-1], strict=True)), **fingers}
    ways = plan_way_home(robot(), plan, joints, ExecutionConfig(), InterruptedArm(released=True, last_motion=lower))
    assert np.abs(ways[-1].positions[-1] - plan.home).max() < 0.02
    assert np.allclose(ways[0].positions[0], lower.positions[-1], atol=1e-3)


def test_a_motion_that_begins_elsewhere_than_where_the_arm_is_is_not_begun():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = LookingOn([scene_of(things)], [0.05])
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(make_task(things, "pick"), start_positions())
    performer = PlanExecutor(robot(), machine, ExecutionConfig(), lambda _: None)
    first, second = (step.trajectory for step in plan.steps[:3] if isinstance(step, MoveStep))
    with pytest.raises(MotionError, match="begins"):
        performer.follow(second)
    assert machine.moves == 0
    performer.follow(first)
    performer.follow(second)
    assert machine.moves == 2


@pytest.mark.parametrize(("higher", "found"), [(0.007, True), (0.05, False)])
def test_a_hand_that_stands_a_little_in_the_table_that_was_seen_finds_home(higher, found):
    """The table is then a little lower than it was seen; a hand deep in it is not where it is thought to be."""
    rng = np.random.default_rng(8)
    things = [detection("ball", ball_cloud(0.6, 0.2, 0.03, rng))]
    plan = ManipulationPlanner(robot(), ExecutionConfig()).plan(
        make_task(things, "place", place=(0.6, 0.0)), start_positions()
    )
    there = next(step.trajectory for step in plan.steps if step.stage == Stage.PLACING and isinstance(step, MoveStep))
    tip = float(robot().gripper(plan.side).tip)
    pose = robot().group(plan.side, start_positions()).forward(there.positions[-1])
    lowest = float((pose[:3, 3] + tip * pose[:3, 0])[2] - 0.025 * abs(pose[2, 2]))
    table = plan.scene.table
    raised = table.pose.copy()
    raised[2, 3] += lowest + higher - plan.scene.table_z
    plan = replace(plan, scene=replace(plan.scene, table=replace(table, pose=raised)))
    joints = {**start_positions(), **dict(zip(there.joint_names, there.positions[-1], strict=True))}
    left = InterruptedArm(released=True)
    if found:
        ways = plan_way_home(robot(), plan, joints, ExecutionConfig(), left)
        assert np.abs(ways[-1].positions[-1] - plan.home).max() < 0.02
    else:
        with pytest.raises(RefusedError):
            plan_way_home(robot(), plan, joints, ExecutionConfig(), left)


@pytest.mark.parametrize("at_home", [True, False])
def test_a_base_stays_where_an_arm_was_left_over_the_table(at_home):
    things = lemon_and_bowl(np.random.default_rng(0))
    task = make_task(things, "pick")
    machine = DrivingRobot(scene_of(things), [0.05])
    parts = Engine(robot(), machine, ExecutionConfig(), lambda _: None)._parts
    plan, base = parts.planner.plan(task, machine.base), parts.base
    state = ExecutionState(task, task, under_way=PlanUnderWay(plan, task))
    actions = TaskActions(state, parts)

    def held_up():
        if not at_home:
            machine.follow(next(step.trajectory for step in plan.steps if isinstance(step, MoveStep)))
        raise MotionError("held up")

    root = there_and_back(
        Action("drive nearer", state, lambda: base.drive_nearer(0.06)),
        (Action("take", state, held_up),),
        Recovery("drive back from a failure", state, (MotionError,), actions.drive_back_from_home),
        Action("drive back", state, base.drive_back),
    )
    root.tick_once()
    assert root.status.name == "FAILURE"
    assert str(state.failure) == "held up"
    assert machine.base.x == (0.0 if at_home else 0.06)
    assert base.is_away is not at_home
    base.drive_back()
    assert machine.base.x == 0.0
    assert not base.is_away


def test_a_base_that_stops_a_little_short_each_time_does_not_wander_off():
    class Short(LookingOn):
        def drive(self, distance):
            self.base = self.base.driven(distance - np.copysign(0.002, distance))

    machine = Short([scene_of(())], [0.05])
    base = BaseDriver(machine)
    for _ in range(20):
        began = base.pose
        base.drive_nearer(0.12)
        assert began.distance_ahead(base.pose) == pytest.approx(0.118)
        base.drive_back()
        assert not base.is_away
        assert abs(machine.base.x) < 0.003


def test_what_the_arm_that_holds_it_cannot_bring_there_is_put_back_and_brought_by_the_other():
    rng = np.random.default_rng(8)
    things = [
        detection("lemon", ball_cloud(0.58, 0.1, 0.027, rng)),
        detection("can", cylinder_cloud(0.75, 0.0, 0.033, 0.11, rng)),
    ]
    told = []
    machine = LookingOn([scene_of(things)], [0.05] * 4)
    engine = Engine(robot(), machine, ExecutionConfig(verify=False, drive_base=False), told.append)
    assert engine.execute(make_task(things, "pick")).in_hand == "lemon"
    (first,) = {status.arm for status in told if status.arm}
    told.clear()
    place = (0.62, -0.38 if first == "left" else 0.42)
    held = replace(make_task(things[1:], "place", place=place), object_text="lemon")  # the lemon is not on the table
    outcome = engine.execute(held)
    assert outcome.success, outcome.reason
    assert outcome.in_hand == ""
    assert {status.arm for status in told if status.arm} == {"left", "right"}


def test_what_was_taken_from_nearer_is_put_back_from_nearer_where_nothing_else_is_in_reach():
    """From where the base is, nothing but places nearer than any free one can be reached with what is held."""

    class Near(ManipulationPlanner):
        def plan_held(self, task, positions, held):
            if task.target_pose[0, 3] > 0.5 or abs(task.target_pose[1, 3] - 0.2) > 0.05:
                raise UnreachableError("place")
            return super().plan_held(task, positions, held)

    rng = np.random.default_rng(8)
    things = [
        detection("lemon", ball_cloud(0.6, 0.2, 0.027, rng)),
        detection("can", cylinder_cloud(0.75, -0.2, 0.033, 0.11, rng)),
    ]
    machine = DrivingRobot(scene_of(things), [0.05] * 4)
    config = ExecutionConfig(verify=False)
    engine = Engine(robot(), machine, config, lambda _: None, Near(robot(), ExecutionConfig()))
    assert engine.execute(make_task(things, "pick")).in_hand == "lemon"
    held = replace(make_task(things[1:], "place", place=(0.62, 0.0)), object_text="lemon")
    outcome = engine.execute(held)
    assert outcome.success, outcome.reason
    assert outcome.in_hand == ""
    assert machine.driven == pytest.approx([0.12, -0.12])


def test_what_was_named_while_the_arm_hid_a_part_of_it_is_the_whole_thing_once_the_arm_is_away():
    """Its other part, seen as another thing, does not stand in its way."""
    rng = np.random.default_rng(9)
    can = detection("can", cylinder_cloud(0.6, 0.2, 0.033, 0.11, rng))
    cloud = np.asarray(can.geometry.cloud)
    low, high = (detection(name, cloud[part]) for name, part in (("a", cloud[:, 2] < 0.74), ("b", cloud[:, 2] > 0.78)))
    task = make_task([low, high, *lemon_and_bowl(rng, (0.6, -0.3))[:1]], "place", place=(0.6, 0.0))
    whole = update_task_unobstructed(task, scene_of([can, task.scene[2]]))
    assert whole.object.id == "can"
    assert {thing.id for thing in whole.scene} == {"can", "lemon"}
