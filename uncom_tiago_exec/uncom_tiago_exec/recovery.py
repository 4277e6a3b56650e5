# SPDX-License-Identifier: Apache-2.0
"""The way home from wherever an arm was left, with or without something in the hand.

First a way is planned from where the arm is. Where it stands too near to things for that, it goes on, or back, along
the motion that led there, which was free when it was planned, and a way is planned from that motion's end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.carrying import carried
from uncom_tiago_exec.collision import CollisionChecker
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, RefusedError
from uncom_tiago_exec.plan import Plan
from uncom_tiago_exec.robot_model import RobotModel
from uncom_tiago_exec.types import FloatArray, Trajectory

_BACK = (0.1, 0.06, 0.03)  # [m] straight ways out to try first
_ON_THE_WAY = 0.15  # [rad, or m] how far from a motion an arm may have come to rest
_AT_HOME = 0.02  # [rad, or m]
_ASTRAY = 0.05  # [rad, or m] farther from home something was not done to its end
_PACE = 0.5


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

    Raises:
        RefusedError: there is no free way; the arm had better stay where it is.
    """
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    here = arm.group.clamp(arm.start)
    try:
        return _planned(arm, plan, here, left)
    except RefusedError as error:
        refusal = error
    for motion in _along(arm, here, left):
        end = motion.positions[-1]
        if float(np.abs(end - plan.home).max()) < _AT_HOME:
            return [motion]
        try:
            return [motion, *_planned(arm, plan, arm.group.clamp(end), left)]
        except RefusedError:
            continue
    raise refusal


def is_astray(robot: RobotModel, plan: Plan, positions: Mapping[str, float]) -> bool:
    """Tell whether the arm of a plan is elsewhere than where the plan began."""
    here = robot.group(plan.side, positions).vector(positions)
    return float(np.abs(here - plan.home).max()) > _ASTRAY


def _planned(arm: ArmPlanner, plan: Plan, here: FloatArray, left: Left) -> list[Trajectory]:
    """Plan from a configuration (8,) to home: straight out of the things first, if the hand is among them."""
    free = _checker(arm, plan, left, near=False)
    goal = arm.group.clamp(plan.home)
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
