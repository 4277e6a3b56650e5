# SPDX-License-Identifier: Apache-2.0
"""The way home from wherever an arm was left, with or without something in the hand."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from uncom_tiago_exec.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.collision import CollisionChecker
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError
from uncom_tiago_exec.fingers import finger_gap
from uncom_tiago_exec.plan import Plan
from uncom_tiago_exec.robot_model import RobotModel
from uncom_tiago_exec.types import FloatArray, Trajectory

_BACK = (0.1, 0.06, 0.03)  # [m] straight ways out to try first


def way_home(
    robot: RobotModel, plan: Plan, positions: Mapping[str, float], config: ExecutionConfig, *, holding: bool
) -> list[Trajectory]:
    """Plan from the present positions to where the plan began: out of the things first, if the hand is among them.

    Raises:
        RefusedError: there is no free way; the arm had better stay where it is.
    """
    arm = ArmPlanner(robot, plan.side, positions, plan.scene, config)
    gap = finger_gap(plan.side, positions)
    free = arm.carrying(plan.grasp, frozenset()) if holding and plan.grasp is not None else arm.free(gap)
    goal = arm.group.clamp(plan.home)
    if not free.is_free(goal):
        free.relax_at(goal)
    here = arm.group.clamp(arm.start)
    try:
        return [arm.timed(arm.transit(free, here, [goal]), free, 0.5)]
    except InCollisionError:
        out, near = _way_out(arm, here, gap, plan, holding=holding)
        return [arm.timed(out, near, 0.4), arm.timed(arm.transit(free, out[-1], [goal]), free, 0.5)]


def _way_out(
    arm: ArmPlanner, here: FloatArray, gap: float, plan: Plan, *, holding: bool
) -> tuple[FloatArray, CollisionChecker]:
    """Return a straight way up, or back along the fingers, that touches nothing new."""
    near = arm.carrying(plan.grasp, TABLE_ONLY) if holding and plan.grasp is not None else arm.reaching(gap)
    if not near.is_free(here):
        near.relax_at(here)
    back = -arm.group.forward(here)[:3, 0]
    error: ExecutionError = PlanningError("there is no free way out")
    for direction in (np.array([0.0, 0.0, 1.0]), back):
        for distance in _BACK:
            try:
                return arm.straight(near, here, distance * direction), near
            except (InCollisionError, PlanningError) as err:
                error = err
    raise error
