# SPDX-License-Identifier: Apache-2.0
"""The way home from wherever an arm was left, with or without something in the hand.

First a way is planned from where the arm is. Where it stands too near to things for that, it goes on, or back, along
the motion that led there, which was free when it was planned, and a way is planned from that motion's end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, RefusedError
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.planning.carry_planner import carried, lean
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import TABLE
from uncom_tiago_exec.scene.scene_model import build_scene, replace_moved
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Trajectory

_BACK = (0.1, 0.06, 0.03)  # [m] straight ways out to try first
_ON_THE_WAY = 0.15  # [rad, or m] how far from a motion an arm may have come to rest
_AT_HOME = 0.02  # [rad, or m]
_THERE = 1e-3  # [rad, or m] nearer than this there is no way to go
_TURNED = np.radians(50.0)  # what leans more than this turns about the line between the pads,
_LEVER = 0.03  # [m] if its middle is farther than this from them
_ASTRAY = 0.05  # [rad, or m] farther from home something was not done to its end
_PACE = 0.5
_LOWER, _LOWERED = 0.003, 5  # [m] by which a table is taken to be lower at a time, and how often at most


@dataclass(frozen=True, slots=True)
class Left:
    """How an arm was left: is something held, was it let go at its place, and by what motion did the arm come here."""

    holding: bool = False
    released: bool = False
    last: Trajectory | None = None
    onwards: bool = False  # the motion's end is nearer to freedom than its start


def way_home(
    robot: RobotModel, plan: Plan, positions: Mapping[str, float], config: ExecutionConfig, left: Left
) -> list[Trajectory]:
    """Plan from the present positions to where the plan began.

    What is held far from its middle would turn over there, and out of the fingers: with that the arm goes to where it
    had lifted it.

    Raises:
        RefusedError: there is no free way; the arm had better stay where it is.
    """
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    here, goal = arm.group.clamp(arm.start), _goal(arm, plan, left)
    if float(np.abs(here - goal).max()) < _THERE:
        return []
    true = _with_true_table(robot, plan, positions, config, left)
    if true is not plan:
        plan, arm = true, ArmPlanner(robot, plan.side, positions, true.scene, config)
    try:
        return _planned(arm, plan, here, left)
    except RefusedError as error:
        refusal = error
    for motion in _along(arm, here, left):
        end = motion.positions[-1]
        if float(np.abs(end - goal).max()) < _AT_HOME:
            return [motion]
        try:
            return [motion, *_planned(arm, plan, arm.group.clamp(end), left)]
        except RefusedError:
            continue
    raise refusal


def _with_true_table(
    robot: RobotModel, plan: Plan, positions: Mapping[str, float], config: ExecutionConfig, left: Left
) -> Plan:
    """Return a plan whose table is as low as it must be where the hand stands in the top that was seen.

    A hand that leans at the table with open fingers is nearer to it than the table's height was seen exactly.
    """
    scene = plan.scene
    for _ in range(_LOWERED):
        arm = ArmPlanner(robot, plan.side, positions, scene, config)
        touching = _checker(arm, plan, left, near=True).relax_at(arm.group.clamp(arm.start))
        if not any(TABLE in pair for pair in touching):
            return plan if scene is plan.scene else replace(plan, scene=scene)
        pose = scene.table.pose.copy()
        pose[2, 3] -= _LOWER
        scene = replace(scene, table=replace(scene.table, pose=pose))
    return plan


def _goal(arm: ArmPlanner, plan: Plan, left: Left) -> FloatArray:
    """Return where to go: home, or where the thing was lifted to."""
    home, grasp, lifted = arm.group.clamp(plan.home), plan.grasp, plan.lifted
    if not left.holding or grasp is None or lifted is None or lean(arm, grasp, home) < _TURNED:
        return home
    pads = grasp.pose[:3, 3] + arm.group.gripper.tip * grasp.approach
    return home if float(np.linalg.norm(pads - plan.scene.moved.middle)) < _LEVER else arm.group.clamp(lifted)


def clear_of_all(
    robot: RobotModel, plan: Plan, positions: Mapping[str, float], config: ExecutionConfig
) -> list[Trajectory]:
    """Return a straight way to where what is held is clear of everything: none if it is already, or there is none."""
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    left, here = Left(holding=True), arm.group.clamp(arm.start)
    if plan.grasp is None or (free := _checker(arm, plan, left, near=False)).is_free(here):
        return []
    near = _checker(arm, plan, left, near=True)
    near.relax_at(here)
    for out in _ways_out(arm, here, near, left):
        if free.is_free(out[-1]):
            return [arm.timed(out, near, 0.4)]
    return []


def as_seen_now(plan: Plan, task: ManipulationTask, *, holding: bool) -> Plan:
    """Return a plan with everything where a task sees it now, but for what is in the hand."""
    scene = build_scene(task)
    return replace(plan, scene=replace_moved(scene, plan.scene.moved) if holding else scene, motion=None)


def is_astray(robot: RobotModel, plan: Plan, positions: Mapping[str, float]) -> bool:
    """Tell whether the arm of a plan is elsewhere than where the plan began."""
    here = robot.group(plan.side, positions).vector(positions)
    return float(np.abs(here - plan.home).max()) > _ASTRAY


def _planned(arm: ArmPlanner, plan: Plan, here: FloatArray, left: Left) -> list[Trajectory]:
    """Plan from a configuration (8,) to home: straight out of the things first, if the hand is among them."""
    free = _checker(arm, plan, left, near=False)
    goal = _goal(arm, plan, left)
    if not free.is_free(goal):
        free.relax_at(goal)
    try:
        return [arm.timed(_way(arm, plan, left, free, here, goal), free, _PACE)]
    except RefusedError as error:  # open fingers around a thing are free, and yet find no way at random
        refusal = error
    near = _checker(arm, plan, left, near=True)
    if not near.is_free(here):
        near.relax_at(here)
    for out in _ways_out(arm, here, near, left):
        try:
            return [arm.timed(out, near, 0.4), arm.timed(_way(arm, plan, left, free, out[-1], goal), free, _PACE)]
        except RefusedError as error:
            refusal = error
    raise refusal


def _way(
    arm: ArmPlanner, plan: Plan, left: Left, free: CollisionChecker, here: FloatArray, goal: FloatArray
) -> FloatArray:
    """Return a free way (N, 8) home, on which a held thing stays upright."""
    if left.holding and plan.grasp is not None:
        return carried(arm, plan.grasp, here, goal)
    return arm.transit(free, here, [goal])


def _checker(arm: ArmPlanner, plan: Plan, left: Left, *, near: bool) -> CollisionChecker:
    """Return what checks motions of the hand as it was left; near, it may touch what it had to do with."""
    gap = arm.start_gap
    if left.holding and plan.grasp is not None:
        return arm.carrying(plan.grasp, TABLE_ONLY if near else frozenset())
    if left.released and plan.motion is not None:
        return arm.leaving(gap, plan.motion, frozenset({arm.scene.moved.name} if near else ()))
    return arm.reaching(gap) if near else arm.free(gap)


def _ways_out(arm: ArmPlanner, here: FloatArray, near: CollisionChecker, left: Left) -> Iterator[FloatArray]:
    """Yield straight ways back along the fingers, and up, that touch nothing new; up first with something held."""
    up, back = np.array([0.0, 0.0, 1.0]), -arm.group.forward(here)[:3, 0]
    for direction in (up, back) if left.holding else (back, up):
        for distance in _BACK:
            try:
                yield arm.straight(near, here, distance * direction)
            except (InCollisionError, PlanningError):
                continue


def _along(arm: ArmPlanner, here: FloatArray, left: Left) -> Iterator[Trajectory]:
    """Yield the rest of the last motion, on and back, from where on it the arm is."""
    last = left.last
    if last is None or last.joint_names != arm.group.joint_names:
        return
    away = np.abs(last.positions - here).max(axis=1)
    k = int(away.argmin())
    if away[k] > _ON_THE_WAY:
        return
    on, back = last.positions[k:], last.positions[: k + 1][::-1]
    for rest in (on, back) if left.onwards else (back, on):
        if float(np.abs(rest[-1] - here).max()) > 1e-3:
            yield arm.along(np.vstack([here, rest[1:]]), _PACE)
