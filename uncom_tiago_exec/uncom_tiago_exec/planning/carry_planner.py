# SPDX-License-Identifier: Apache-2.0
"""Free motions with something in the hand: it is kept as upright as it was taken, as far as there is such a way.

What leans swings about the line between the pads, and with gravity along that line the fingers yield to one side.
"""

from __future__ import annotations

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.kinematics.cartesian_path import straight_path
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.joint_planner import JointPlanner, PlannerOptions
from uncom_tiago_exec.planning.options import CARRY_PLANNER, CarryPlannerOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray


class UprightConstraint:
    """The held object leans at most by a limit, and the hand does not dive below a height."""

    def __init__(
        self,
        group: ArmGroup,
        grasp: Grasp,
        limit: float,
        floor: float = -np.inf,
        *,
        options: CarryPlannerOptions = CARRY_PLANNER,
    ) -> None:
        """Take the object as upright in the hand of `grasp`.

        Args:
            group: that moves.
            grasp: with which the object was taken while it stood.
            limit: of leaning [rad].
            floor: least height of the grasping frame in the base frame [m].
            options: numbers that tune it.
        """
        self.step = options.lean_step_rad
        self._group = group
        self._floor = floor
        self._up = grasp.pose[2, :3].copy()  # the vertical in the frame of the hand as it took the object
        self._least = float(np.cos(limit))

    def holds(self, q: FloatArray) -> bool:
        """Tell whether the object is upright enough, and the hand high enough, at a configuration (8,)."""
        row = self._group.forward(q)[2]
        return float(row[:3] @ self._up) >= self._least and float(row[3]) >= self._floor


def lean_angle(arm: ArmPlanner, grasp: Grasp, q: FloatArray) -> float:
    """Return how far from upright an object is at a configuration (8,) [rad]; it was upright when it was taken."""
    return float(np.arccos(np.clip(arm.group.forward(q)[2, :3] @ grasp.pose[2, :3], -1.0, 1.0)))


def straight_transfer(
    arm: ArmPlanner,
    grasp: Grasp,
    lifted: FloatArray,
    lowering: CollisionChecker,
    lower: FloatArray,
    *,
    options: CarryPlannerOptions = CARRY_PLANNER,
) -> tuple[FloatArray | None, FloatArray]:
    """Return the straight way of the hand from the lifted object (8,) to above its place, and from there down.

    The object is upright throughout, and the arm does not turn over. Where that cannot be the way is None, and the way
    down the given one (N, 8), which `lowering` has checked.
    """
    above, down = arm.group.forward(lower[0]), arm.group.forward(lower[-1])
    try:
        over = straight_path(arm.solver, arm.carrying(grasp, frozenset()), lifted, above)
        if float((np.abs(np.diff(over, axis=0)) / arm.limits.velocity).max(axis=1).sum()) > options.straight_limit_s:
            return None, lower
        return over, arm.straight(lowering, over[-1], down[:3, 3] - above[:3, 3])
    except (InCollisionError, PlanningError):
        return None, lower


def plan_upright_motion(
    arm: ArmPlanner,
    grasp: Grasp,
    start: FloatArray,
    goal: FloatArray,
    *,
    strict: bool = False,
    options: CarryPlannerOptions = CARRY_PLANNER,
) -> FloatArray:
    """Return a free way (N, 8) with the object in the hand from start to goal, both (8,), the more upright the better.

    The hand does not go around beside the table lower than its top, unless it begins or ends there.

    Raises:
        PlanningError, InCollisionError: there is no way, however it leans; strict, none on which it leans little.
    """
    checker = arm.carrying(grasp, frozenset())
    least = max(lean_angle(arm, grasp, start), lean_angle(arm, grasp, goal)) + options.more_lean_rad
    floor = min(arm.scene.table_z, *(float(arm.group.forward(q)[2, 3]) for q in (start, goal)))
    budget = PlannerOptions(time_s=min(options.search_time_s, arm.config.planning_time_s / 2.0))

    def plan_upright(limit: float) -> FloatArray:
        upright = UprightConstraint(checker.group, grasp, max(limit, least), floor, options=options)
        return JointPlanner(checker.constrained(upright), budget).plan(start, [goal])

    leaning = PlanningError("there is no way on which it stays upright")
    for path in Alternatives(options.leans_rad, plan_upright, error=leaning, recoverable=(PlanningError,)):
        return path
    if strict:
        raise leaning
    return arm.transit(checker, start, [goal])
