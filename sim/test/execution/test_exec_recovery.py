# SPDX-License-Identifier: Apache-2.0
"""What goes wrong on the way is noticed and done again: held-up arms, jammed fingers, things that ended elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import (
    LookingOn,
    ObedientRobot,
    ball_cloud,
    bowl_cloud,
    box_cloud,
    cylinder_cloud,
    lemon_and_bowl,
    make_task,
    robot,
    start_positions,
)
from uncom_perception.types import Scene
from uncom_sim.bench_planning.scenes import TABLE_Z, detection, flat_table
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import MotionError, StoppedError
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.grasping.grasps import grasp_candidates
from uncom_tiago_exec.observation.object_reidentification import (
    find_object,
    merge_tables,
    update_task,
    with_remembered_objects,
)
from uncom_tiago_exec.observation.verification import verify
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import UprightConstraint, lean_angle
from uncom_tiago_exec.planning.plan import MoveStep
from uncom_tiago_exec.scene.object_shape import complete_shape
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.types import Stage

CONFIG = ExecutionConfig()


def scene_of(*things):
    return Scene(0.0, "base_footprint", things, flat_table(), (), "test")


def lemon_at(x, y, z=0.0, seed=1):
    return detection("lemon", ball_cloud(x, y, 0.027, np.random.default_rng(seed)) + np.array([0.0, 0.0, z]))


def test_a_held_thing_is_carried_upright():
    for seed, start, goal in ((0, 0.28, (0.6, 0.02)), (1, 0.05, (0.55, 0.3)), (2, -0.25, (0.62, 0.0))):
        rng = np.random.default_rng(seed)
        can = detection("can", cylinder_cloud(0.6, start, 0.033, 0.12, rng))
        box = detection("box", box_cloud(0.72, 0.14, 0.3, np.array([0.1, 0.08, 0.2]), rng))
        task = make_task([can, box], "place", place=goal)
        plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
        arm = ArmPlanner(robot(), plan.side, start_positions(), plan.scene, CONFIG)
        carried = [s for s in plan.steps if isinstance(s, MoveStep) and s.stage in (Stage.LIFTING, Stage.TRANSFERRING)]
        assert carried
        leans = [lean_angle(arm, plan.grasp, q) for s in carried for q in s.trajectory.positions]
        assert max(leans) < np.radians(55.0)
        heights = [arm.group.forward(q)[2, 3] for s in carried for q in s.trajectory.positions]
        assert min(heights) > plan.scene.table_z


def with_a_lifted_can():
    """Return an arm that has lifted a can, its grasp, what checks its motions, and where it is (8,)."""
    rng = np.random.default_rng(0)
    task = make_task([detection("can", cylinder_cloud(0.6, 0.1, 0.033, 0.12, rng))], "pick")
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    arm = ArmPlanner(robot(), plan.side, start_positions(), plan.scene, CONFIG)
    free = arm.carry_checker(plan.grasp, frozenset())
    here = next(s.trajectory.positions[-1] for s in plan.steps if s.stage == Stage.LIFTING)
    return arm, plan.grasp, free, here


def test_the_hand_does_not_dive_beside_the_table_with_what_it_carries():
    arm, grasp, free, here = with_a_lifted_can()
    height = float(arm.group.forward(here)[2, 3])
    for floor, is_kept in ((height - 0.01, True), (height + 0.01, False)):
        assert free.constrained(UprightConstraint(free.group, grasp, np.pi, floor)).is_free(here) == is_kept


def test_another_grasp_gets_a_checker_of_its_own():
    arm, grasp, _, _ = with_a_lifted_can()
    narrow = arm.carry_checker(replace(grasp, width=0.03), frozenset())
    wide = arm.carry_checker(replace(grasp, width=0.07), frozenset())
    assert wide is not narrow
    assert wide.group is not narrow.group


def test_the_limit_of_leaning_holds_for_states_and_for_ways_between_them():
    arm, grasp, free, here = with_a_lifted_can()
    upright = free.constrained(UprightConstraint(free.group, grasp, np.radians(30.0)))
    wrist = np.zeros(8)
    wrist[6] = 1.0
    states = [here + turn * wrist for turn in np.linspace(-0.8, 0.8, 9)]
    kept = [lean_angle(arm, grasp, q) <= np.radians(30.0) for q in states]
    assert any(kept)
    assert not all(kept)
    for q, is_kept in zip(states, kept, strict=True):
        assert upright.is_free(q) == (is_kept and free.is_free(q))
    ends = states[0], states[-1]
    assert not upright.segment_is_free(*ends)
    assert not upright.path_is_free(np.vstack(ends))
    assert upright.segment_is_free(here, here)


def test_an_arm_held_up_on_its_way_to_the_thing_goes_back_and_tries_another_way():
    class HeldUp(ObedientRobot):
        def follow(self, trajectory):
            super().follow(trajectory)
            if self.moves == 2:
                raise MotionError("arm_left_controller gave up: path tolerance")

    things = lemon_and_bowl(np.random.default_rng(0))
    told = []
    machine = HeldUp(scene_of(*things), [0.05])
    outcome = Engine(robot(), machine, ExecutionConfig(verify=False), told.append).execute(
        make_task(things, "put_in", target="bowl")
    )
    assert outcome.success, outcome.reason
    poses = [s.data["grasp"]["pose"] for s in told if "grasp" in s.data]
    assert len(poses) == 2
    assert not np.allclose(poses[0], poses[1], atol=0.01)


def test_what_ended_elsewhere_is_looked_for_and_brought_to_its_place():
    things = lemon_and_bowl(np.random.default_rng(0))
    beside = scene_of(lemon_at(0.62, 0.06), *things[1:])
    there = scene_of(lemon_at(0.48, 0.12), *things[1:])
    told = []
    machine = LookingOn([beside, beside, there], [0.05])
    task = make_task(things, "place", place=(0.48, 0.12))
    outcome = Engine(robot(), machine, CONFIG, told.append).execute(task)
    assert outcome.success, outcome.reason
    assert [s.data["attempt"] for s in told if "attempt" in s.data] == [1, 2]
    second = [s.data["grasp"]["pose"] for s in told if "grasp" in s.data][1]
    assert np.hypot(second[0][3] - 0.62, second[1][3] - 0.06) < 0.16


def test_a_thing_that_is_gone_is_not_mistaken_for_its_neighbour():
    rng = np.random.default_rng(3)
    lemon, orange = lemon_at(0.6, 0.2), detection("orange", ball_cloud(0.6, 0.29, 0.03, rng))
    task = make_task([lemon, orange], "pick")
    assert find_object(scene_of(orange), task) is None
    rolled = lemon_at(0.7, 0.05)
    assert find_object(scene_of(orange, rolled), task) is rolled
    pushed = detection("orange", ball_cloud(0.6, 0.3, 0.03, np.random.default_rng(4)))
    assert find_object(scene_of(pushed, rolled), task) is rolled


class Jammed(ObedientRobot):
    """Its fingers do not open from what they hold before they have pressed `jams` times more."""

    def __init__(self, scene, widths, jams):
        super().__init__(scene, widths)
        self.jams = jams
        self.holding = False

    def grip(self, side, gap):
        if self.holding and gap > self.widths[0]:
            if self.jams > 0:
                return super().grip(side, 0.0)
            self.holding = False
        if gap < self.widths[0]:
            self.jams -= self.holding
            self.holding = True
        return super().grip(side, gap)


@pytest.mark.parametrize("jams", [3, 50])
def test_fingers_that_are_jammed_close_and_open_again_and_never_tear_the_thing_away(jams):
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = Jammed(scene_of(lemon_at(0.6, -0.08, 0.01), *things[1:]), [0.05], jams)
    outcome = Engine(robot(), machine, CONFIG, lambda _: None).execute(make_task(things, "put_in", target="bowl"))
    assert outcome.success == (jams < 10)
    assert outcome.in_hand == ("" if jams < 10 else "lemon")
    if jams > 10:
        assert "fingers do not open" in outcome.reason


class Hemmed(ObedientRobot):
    """Something beside what it holds keeps its fingers from opening wide, once they have held it."""

    def __init__(self, scene, widths, room):
        super().__init__(scene, widths)
        self.room = room
        self.held = False

    def grip(self, side, gap):
        self.held |= gap < self.widths[0]
        return super().grip(side, min(gap, self.widths[0] + self.room) if self.held else gap)


def test_fingers_that_a_neighbour_keeps_from_opening_wide_have_let_go_all_the_same():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = Hemmed(scene_of(lemon_at(0.6, -0.08, 0.01), *things[1:]), [0.05], 0.014)
    outcome = Engine(robot(), machine, CONFIG, lambda _: None).execute(make_task(things, "put_in", target="bowl"))
    assert outcome.success, outcome.reason
    assert outcome.in_hand == ""


def test_what_the_fingers_did_not_let_go_is_brought_home_and_set_down_by_the_next_command():
    things = lemon_and_bowl(np.random.default_rng(0))
    machine = Jammed(scene_of(lemon_at(0.6, -0.08, 0.01), *things[1:]), [0.05], 50)
    engine = Engine(robot(), machine, CONFIG, lambda _: None)
    assert engine.execute(make_task(things, "put_in", target="bowl")).in_hand == "lemon"
    away = {n: abs(machine.joints[n] - v) for n, v in start_positions().items() if "finger" not in n}
    assert max(away.values()) < 0.01
    machine.jams = 0
    outcome = engine.execute(make_task(things, "put_in", target="bowl"))
    assert outcome.success, outcome.reason
    assert outcome.in_hand == ""


def test_a_wide_dish_is_rather_held_beside_its_handle():
    rng = np.random.default_rng(5)
    pan = bowl_cloud(0.6, 0.0, 0.11, 0.045, rng)
    angle = np.pi / 2.0
    handle = box_cloud(0.6, 0.19, angle, np.array([0.16, 0.025, 0.015]), rng) + np.array([0.0, 0.0, 0.025])
    shape = complete_shape("pan", np.vstack([pan, handle]), TABLE_Z)
    assert shape.rim is not None
    best = [g for g in grasp_candidates(shape, np.zeros((0, 3)), robot().gripper("left")) if g.family == "rim"][:4]
    sides = [float((g.pose[:3, 3] + robot().gripper("left").tip * g.approach)[1]) for g in best]
    assert min(sides) > -0.06


def test_two_things_seen_as_one_do_not_hide_that_the_thing_stands_at_its_place():
    rng = np.random.default_rng(7)
    box = detection("box", box_cloud(0.6, 0.25, 0.0, np.array([0.16, 0.06, 0.16]), rng))
    mug = detection("mug", cylinder_cloud(0.6, -0.15, 0.04, 0.09, rng))
    task = make_task([box, mug], "place", place=(0.6, 0.03))
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    motion = plan.motion
    cloud = np.asarray(box.geometry.cloud, dtype=float) @ motion[:3, :3].T + motion[:3, 3]
    both = detection("box", np.vstack([cloud, np.asarray(mug.geometry.cloud, dtype=float)]))
    assert verify(task, plan, scene_of(both)).success
    assert not verify(task, plan, scene_of(mug)).success


@pytest.mark.parametrize(("seen", "stands"), [("whole", True), ("slice", True), ("lying", False)])
def test_a_thing_has_fallen_over_only_if_enough_of_it_is_seen_lying(seen, stands):
    """Of what an arm or the border of the picture hides, a slice near the table tells nothing."""
    rng = np.random.default_rng(9)
    bottle = detection("bottle", cylinder_cloud(0.6, 0.2, 0.03, 0.2, rng))
    task = make_task([bottle], "place", place=(0.6, 0.0))
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    placed = np.asarray(bottle.geometry.cloud, dtype=float) @ plan.motion[:3, :3].T + plan.motion[:3, 3]
    if seen == "slice":
        placed = placed[placed[:, 2] < TABLE_Z + 0.025]
    if seen == "lying":
        placed = box_cloud(0.6, 0.0, 0.3, np.array([0.2, 0.06, 0.06]), rng)
    finding = verify(task, plan, scene_of(detection("bottle", placed)))
    assert finding.success == stands, finding.text
    assert ("fallen" in finding.text) != stands


def test_a_table_seen_from_nearer_keeps_the_edge_that_is_out_of_sight():
    before, now = flat_table(), flat_table()
    beyond = np.maximum(np.asarray(now.polygon), [0.55, -np.inf, -np.inf])
    both = merge_tables(before, replace(now, polygon=beyond))
    assert np.asarray(both.polygon)[:, 0].min() == pytest.approx(np.asarray(before.polygon)[:, 0].min(), abs=1e-6)
    assert np.asarray(both.polygon)[:, 0].max() == pytest.approx(np.asarray(before.polygon)[:, 0].max(), abs=1e-6)
    assert both.height_m == pytest.approx(now.height_m)
    higher = replace(now, polygon=beyond + np.array([0.0, 0.0, 0.2]))
    assert merge_tables(before, higher) is higher
    assert merge_tables(None, now) is now
    assert merge_tables(before, None) is before


def test_a_base_stopped_on_its_way_is_driven_back_as_far_as_it_had_come():
    class StoppedHalfway(ObedientRobot):
        halfway = True

        def drive(self, distance):
            self.base = self.base.driven(distance / 2.0 if self.halfway else distance)
            if self.halfway:
                self.halfway = False
                raise StoppedError("stopped on request")

    can = detection("can", cylinder_cloud(0.93, 0.2, 0.033, 0.11, np.random.default_rng(5)))
    machine = StoppedHalfway(scene_of(can), [0.066])
    engine = Engine(robot(), machine, CONFIG, lambda _: None)
    assert "stopped" in engine.execute(make_task([can], "pick")).reason
    assert machine.base.x > 0.02
    engine.execute(make_task([can], "none"))
    assert machine.base.x == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("before", "told"), [("whole", True), ("part", False)])
def test_what_was_seen_in_part_before_is_not_said_to_have_been_moved(before, told):
    """An arm that hid one end of it has made its middle seem elsewhere."""
    rng = np.random.default_rng(4)
    lemon = detection("lemon", ball_cloud(0.55, 0.2, 0.027, rng))
    box = box_cloud(0.7, -0.1, 0.0, np.array([0.08, 0.16, 0.08]), rng)
    was = detection("box", box - np.array([0.03, 0.0, 0.0]) if before == "whole" else box[box[:, 1] > -0.12])
    task = make_task([lemon, was], "place", place=(0.55, 0.0))
    plan = ManipulationPlanner(robot(), CONFIG).plan(task, start_positions())
    placed = np.asarray(lemon.geometry.cloud, dtype=float) @ plan.motion[:3, :3].T + plan.motion[:3, 3]
    after = Scene(0.0, "base_footprint", (detection("lemon", placed), detection("box", box)), flat_table(), (), "test")
    finding = verify(task, plan, after)
    assert finding.success
    assert ([name for name, _ in finding.moved] == ["box"]) == told


def test_what_is_out_of_sight_from_nearer_is_remembered():
    """What stands right before the robot leaves the picture when the base drives; it still stands there."""
    rng = np.random.default_rng(6)
    far = detection("can", cylinder_cloud(0.85, 0.1, 0.033, 0.11, rng))
    near = detection("bottle", cylinder_cloud(0.52, -0.05, 0.03, 0.2, rng))
    beside = detection("box", box_cloud(0.7, -0.3, 0.0, np.array([0.1, 0.08, 0.1]), rng))
    task = make_task([far, near, beside], "place", place=(0.7, 0.2))
    now = update_task(task, scene_of(far, beside))
    assert {thing.label for thing in now.scene} == {"can", "box"}
    remembered = with_remembered_objects(now, task)
    assert sorted(thing.label for thing in remembered.scene) == ["bottle", "box", "can"]
    assert with_remembered_objects(update_task(task, scene_of(far, near, beside)), task).scene == (far, near, beside)
