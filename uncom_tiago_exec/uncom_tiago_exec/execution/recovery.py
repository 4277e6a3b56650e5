# SPDX-License-Identifier: Apache-2.0
"""The way home from wherever an arm was left, with or without something in the hand.

First a path is planned from where the arm is. Where it stands too near to objects for that, it goes on, or back, along
the motion that led there, which was free when it was planned, and a path is planned from that motion's end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import PlanningError, RefusedError
from uncom_tiago_exec.execution.options import RECOVERY, RecoveryOptions
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.planning.carry_planner import lean_angle, plan_upright_motion
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import TABLE
from uncom_tiago_exec.scene.scene_model import build_scene, replace_moved
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Trajectory


@dataclass(frozen=True, slots=True)
class InterruptedArm:
    """How an arm was left.

    Attributes:
        holding: something is in its hand.
        released: the object was let go at its place.
        last_motion: the motion by which the arm came here, be it to its end or not.
        forward_first: the end of that motion is nearer to freedom than its start.
    """

    holding: bool = False
    released: bool = False
    last_motion: Trajectory | None = None
    forward_first: bool = False


def plan_way_home(
    robot: RobotModel,
    plan: Plan,
    positions: Mapping[str, float],
    config: ExecutionConfig,
    left: InterruptedArm,
    options: RecoveryOptions = RECOVERY,
) -> list[Trajectory]:
    """Plan from the present joint positions to where a plan began.

    What is held far from its centre would turn over there, and out of the fingers: with that the arm goes to where it
    had lifted it.

    Args:
        robot: the robot's model.
        plan: whose arm was left, in its scene.
        positions: of all joints now, by name [rad, m].
        config: of the node.
        left: how the arm was left.
        options: of recovery.

    Raises:
        RefusedError: there is no free path; the arm had better stay where it is.
    """
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    here = arm.group.clamp(arm.start)
    home = _WayHome(arm, plan, left, options)
    if float(np.abs(here - home.goal).max()) < options.no_motion:
        return []
    lowered = _with_lowered_table(robot, plan, positions, config, left, options)
    if lowered is not plan:
        home = _WayHome(ArmPlanner(robot, plan.side, positions, lowered.scene, config), lowered, left, options)
    try:
        return home.planned_from(here)
    except RefusedError as refusal:
        motions = home.along_last_motion(here)
        for onward in Alternatives(motions, home.planned_after, error=refusal, recoverable=(RefusedError,)):
            return onward
        raise


def plan_lift_clear(
    robot: RobotModel,
    plan: Plan,
    positions: Mapping[str, float],
    config: ExecutionConfig,
    options: RecoveryOptions = RECOVERY,
) -> list[Trajectory]:
    """Return a straight motion to where what is held touches nothing; none if it does not, or there is no such motion.

    Args:
        robot: the robot's model.
        plan: that has put something into the hand, in the scene as it is now.
        positions: of all joints now, by name [rad, m].
        config: of the node.
        options: of recovery.
    """
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    home, here = _WayHome(arm, plan, InterruptedArm(holding=True), options), arm.group.clamp(arm.start)
    if plan.grasp is None or (free := home.checker(near=False)).is_free(here):
        return []
    near = home.checker(near=True)
    near.lower_margins_at(here)
    for out in home.retreats(here, near):
        if free.is_free(out[-1]):
            return [arm.timed(out, near, options.retreat_speed_scale)]
    return []


def plan_in_present_scene(plan: Plan, task: ManipulationTask, *, holding: bool) -> Plan:
    """Return a plan with everything where a task in base_footprint sees it now, but for what is in the hand."""
    scene = build_scene(task)
    return replace(plan, scene=replace_moved(scene, plan.scene.moved) if holding else scene, motion=None)


def is_away_from_home(
    robot: RobotModel, plan: Plan, positions: Mapping[str, float], options: RecoveryOptions = RECOVERY
) -> bool:
    """Tell whether the arm of a plan is elsewhere than where the plan began."""
    here = robot.group(plan.side, positions).vector(positions)
    return float(np.abs(here - plan.home).max()) > options.away


def _with_lowered_table(
    robot: RobotModel,
    plan: Plan,
    positions: Mapping[str, float],
    config: ExecutionConfig,
    left: InterruptedArm,
    options: RecoveryOptions,
) -> Plan:
    """Return a plan whose table is as low as it must be where the hand stands in the top that was seen.

    A hand that leans at the table with open fingers is nearer to it than the table's height was seen exactly.
    """
    scene = plan.scene
    for _ in range(options.table_steps):
        arm = ArmPlanner(robot, plan.side, positions, scene, config)
        near = _WayHome(arm, plan, left, options).checker(near=True)
        if not any(TABLE in pair for pair in near.lower_margins_at(arm.group.clamp(arm.start))):
            return plan if scene is plan.scene else replace(plan, scene=scene)
        pose = scene.table.pose.copy()
        pose[2, 3] -= options.table_step_m
        scene = replace(scene, table=replace(scene.table, pose=pose))
    return plan


class _WayHome:
    """Plans for one arm as it was left."""

    def __init__(self, arm: ArmPlanner, plan: Plan, left: InterruptedArm, options: RecoveryOptions) -> None:
        self.arm = arm
        self._plan = plan
        self._left = left
        self._options = options

    @property
    def goal(self) -> FloatArray:
        """Where to go (8,): home, or where the object was lifted to."""
        arm, plan, options = self.arm, self._plan, self._options
        home, grasp, lifted = arm.group.clamp(plan.home), plan.grasp, plan.lifted
        if not self._left.holding or grasp is None or lifted is None:
            return home
        if lean_angle(arm, grasp, home) < np.radians(options.turn_deg):
            return home
        pads = grasp.pose[:3, 3] + arm.group.gripper.tip * grasp.approach
        lever = float(np.linalg.norm(pads - plan.scene.moved.middle))
        return home if lever < options.lever_m else arm.group.clamp(lifted)

    def planned_from(self, here: FloatArray) -> list[Trajectory]:
        """Plan from a configuration (8,) to the goal: straight out of the objects first, if the hand is among them.

        Raises:
            RefusedError: there is no free path.
        """
        arm, options, goal = self.arm, self._options, self.goal
        free = self.checker(near=False)
        if not free.is_free(goal):
            free.lower_margins_at(goal)

        def retreats() -> Iterator[tuple[FloatArray, CollisionChecker] | None]:
            yield None
            # Open fingers around an object are free, and yet find no path at random: straight out first.
            near = self.checker(near=True)
            if not near.is_free(here):
                near.lower_margins_at(here)
            yield from ((out, near) for out in self.retreats(here, near))

        def planned_by(retreat: tuple[FloatArray, CollisionChecker] | None) -> list[Trajectory]:
            if retreat is None:
                return [arm.timed(self._path(free, here, goal), free, options.speed_scale)]
            out, near = retreat
            onward = self._path(free, out[-1], goal)
            return [arm.timed(out, near, options.retreat_speed_scale), arm.timed(onward, free, options.speed_scale)]

        refusal = PlanningError("there is no free path")
        return Alternatives(retreats(), planned_by, error=refusal, recoverable=(RefusedError,)).first()

    def planned_after(self, motion: Trajectory) -> list[Trajectory]:
        """Plan a motion, and from its end on to the goal if that is not there.

        Raises:
            RefusedError: there is no free path.
        """
        end = motion.positions[-1]
        if float(np.abs(end - self.goal).max()) < self._options.home_tolerance:
            return [motion]
        return [motion, *self.planned_from(self.arm.group.clamp(end))]

    def _path(self, free: CollisionChecker, here: FloatArray, goal: FloatArray) -> FloatArray:
        """Return a free path (N, 8) on which a held object stays upright."""
        if self._left.holding and self._plan.grasp is not None:
            return plan_upright_motion(self.arm, self._plan.grasp, here, goal)
        return self.arm.transit(free, here, [goal])

    def checker(self, *, near: bool) -> CollisionChecker:
        """Return what checks motions of the hand as it was left; near, it may touch what it had to do with."""
        arm, plan, left = self.arm, self._plan, self._left
        gap = arm.start_gap
        if left.holding and plan.grasp is not None:
            return arm.carry_checker(plan.grasp, TABLE_ONLY if near else frozenset())
        if left.released and plan.motion is not None:
            return arm.retreat_checker(gap, plan.motion, frozenset({arm.scene.moved.name} if near else ()))
        return arm.approach_checker(gap) if near else arm.free_motion_checker(gap)

    def retreats(self, here: FloatArray, near: CollisionChecker) -> Iterator[FloatArray]:
        """Return straight paths back along the fingers and up that touch nothing new; up first with something held."""
        up, back = np.array([0.0, 0.0, 1.0]), -self.arm.group.forward(here)[:3, 0]
        directions = (up, back) if self._left.holding else (back, up)
        ways = (distance * direction for direction in directions for distance in self._options.retreats_m)
        refusal = PlanningError("there is no straight way out")
        return Alternatives(ways, lambda way: self.arm.straight(near, here, way), error=refusal, recoverable=BLOCKED)

    def along_last_motion(self, here: FloatArray) -> Iterator[Trajectory]:
        """Yield the rest of the last motion, forward and back, from where on it the arm is."""
        last = self._left.last_motion
        if last is None or last.joint_names != self.arm.group.joint_names:
            return
        away = np.abs(last.positions - here).max(axis=1)
        nearest = int(away.argmin())
        if away[nearest] > self._options.near_motion:
            return
        forward, back = last.positions[nearest:], last.positions[: nearest + 1][::-1]
        for rest in (forward, back) if self._left.forward_first else (back, forward):
            if float(np.abs(rest[-1] - here).max()) > self._options.no_motion:
                yield self.arm.timed_unchecked(np.vstack([here, rest[1:]]), self._options.speed_scale)
