# SPDX-License-Identifier: Apache-2.0
"""Free motions with an object in the hand, which keep it as upright as it was grasped, as far as possible.

An object that leans swings about the line between the pads, and where gravity acts along that line both fingers yield
to one side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.kinematics.cartesian_path import straight_path
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.joint_planner import JointPlanner
from uncom_tiago_exec.planning.options import CARRY_PLANNER, PLANNER, CarryPlannerOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.types import FloatArray


class UprightConstraint:
    """Constraint: the held object leans by no more than a limit, and the hand stays above a height.

    Attributes:
        step: greatest change of a joint between two configurations of a path at which it is checked [rad, or m].
    """

    def __init__(
        self,
        group: ArmGroup,
        grasp: Grasp,
        limit: float,
        floor: float = -np.inf,
        *,
        options: CarryPlannerOptions = CARRY_PLANNER,
    ) -> None:
        """Constrain an object that was upright when it was grasped.

        Args:
            group: that moves.
            grasp: by which the object is held.
            limit: greatest lean [rad].
            floor: least height of the grasping frame in base_footprint [m].
            options: numbers that tune it.
        """
        self.step = options.lean_step_rad
        self._group = group
        self._floor = floor
        self._up = grasp.pose[2, :3].copy()  # the vertical in the grasping frame when the object was grasped
        self._least_cosine = float(np.cos(limit))

    def holds(self, q: FloatArray) -> bool:
        """Tell whether the object is upright enough, and the hand high enough, at a configuration (8,)."""
        row = self._group.forward(q)[2]
        return float(row[:3] @ self._up) >= self._least_cosine and float(row[3]) >= self._floor


def lean_angle(arm: ArmPlanner, grasp: Grasp, q: FloatArray) -> float:
    """Return the angle between the axis of a held object and the vertical at a configuration (8,) [rad].

    The object was upright when it was grasped: this is the angle between the verticals of then and now in the grasping
    frame.
    """
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
    """Return straight motions of the hand to above the place and from there down, with the object upright throughout.

    Args:
        arm: planner of the arm that holds it.
        grasp: by which it is held.
        lifted: configuration (8,) after lifting.
        lowering: checker of the motion down.
        lower: path down (N, 8) that `lowering` has accepted.
        options: numbers that tune it.

    Returns:
        Path (M, 8) to above the place and path (N, 8) down. Where the straight motion is blocked, would change the
        posture of the arm or take too long, the first is None and the second `lower`.
    """
    above, down = arm.group.forward(lower[0]), arm.group.forward(lower[-1])
    try:
        over = straight_path(arm.solver, arm.carry_checker(grasp, frozenset()), lifted, above)
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
    """Return a free path with the object in the hand on which it leans as little as possible.

    The limits of the lean are tried one after the other. Beside the table the hand does not get lower than its top,
    unless it starts or ends there.

    Args:
        arm: planner of the arm that holds the object.
        grasp: by which it is held.
        start: configuration (8,).
        goal: configuration (8,).
        strict: whether to fail where no limit of the lean can be kept, instead of planning without one.
        options: numbers that tune it.

    Returns:
        Waypoints (N, 8).

    Raises:
        PlanningError: no path was found in the time, or none within the limits of the lean if `strict`.
        InCollisionError: the start is in collision.
    """
    checker = arm.carry_checker(grasp, frozenset())
    least_limit = max(lean_angle(arm, grasp, start), lean_angle(arm, grasp, goal)) + options.more_lean_rad
    floor = min(arm.scene.table_z, *(float(arm.group.forward(q)[2, 3]) for q in (start, goal)))
    budget = replace(PLANNER, time_s=min(options.search_time_s, arm.search_time_s))

    def plan_upright(limit: float) -> FloatArray:
        upright = UprightConstraint(checker.group, grasp, max(limit, least_limit), floor, options=options)
        return JointPlanner(checker.constrained(upright), budget).plan(start, [goal])

    leaning_error = PlanningError("there is no way on which it stays upright")
    for path in Alternatives(options.leans_rad, plan_upright, error=leaning_error, recoverable=(PlanningError,)):
        return path
    if strict:
        raise leaning_error
    return arm.transit(checker, start, [goal])
