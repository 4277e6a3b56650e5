# SPDX-License-Identifier: Apache-2.0
"""Free motions with something in the hand: it is kept as upright as it was taken, as far as there is such a way.

What leans swings about the line between the pads, and with gravity along that line the fingers yield to one side.
"""

from __future__ import annotations

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker, densify
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.kinematics.cartesian_path import straight_path
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.joint_planner import JointPlanner, PlannerOptions
from uncom_tiago_exec.types import FloatArray

_LEANS = np.radians([25.0, 50.0])  # limits tried one after the other
_MORE = np.radians(5.0)  # than where it begins or ends
_LEAN_STEP = 0.05  # [rad] between two configurations whose lean is looked at
_WINDING_S = 4.0  # [s] at full speed that a straight way may take
_TIME_S = 0.25  # for each limit


class UprightChecker(CollisionChecker):
    """Another checker's pairs and margins; the thing may not lean more than a limit either, nor the hand dive."""

    def __init__(self, checker: CollisionChecker, grasp: Grasp, limit: float, floor: float = -np.inf) -> None:
        """Share everything with the checker; limit [rad] of leaning, floor [m] under which the hand may not go."""
        vars(self).update(vars(checker))
        self._floor = floor
        self._up = grasp.pose[2, :3].copy()  # the vertical in the frame of the hand as it took the thing
        self._least = float(np.cos(limit))

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps every margin and the limit."""
        return self._is_upright(q) and super().is_free(q)

    def first_collision(self, path: FloatArray, step: float = 0.005) -> FloatArray | None:
        """Return a configuration of a polyline (N, 8) that does not keep the margins or the limit, or None."""
        for q in densify(path, _LEAN_STEP):
            if not self._is_upright(q):
                return np.asarray(q)
        return super().first_collision(path, step)

    def way_is_free(self, start: FloatArray, end: FloatArray, step: float = 0.005) -> bool:
        """Check a straight line (8,) to (8,)."""
        count = max(2, int(np.ceil(np.abs(end - start).max() / _LEAN_STEP)) + 1)
        upright = all(self._is_upright(q) for q in np.linspace(start, end, count))
        return upright and super().way_is_free(start, end, step)

    def _is_upright(self, q: FloatArray) -> bool:
        row = self.group.forward(q)[2]
        return float(row[:3] @ self._up) >= self._least and float(row[3]) >= self._floor


def lean(arm: ArmPlanner, grasp: Grasp, q: FloatArray) -> float:
    """Return how far from upright a thing is at a configuration (8,) [rad]; it was upright when it was taken."""
    return float(np.arccos(np.clip(arm.group.forward(q)[2, :3] @ grasp.pose[2, :3], -1.0, 1.0)))


def straight_over(
    arm: ArmPlanner, grasp: Grasp, lifted: FloatArray, lowering: CollisionChecker, lower: FloatArray
) -> tuple[FloatArray | None, FloatArray]:
    """Return the straight way of the hand from the lifted thing (8,) to above its place, and from there down.

    The thing is upright throughout, and the arm does not turn over. Where that cannot be the way is None, and the way
    down the given one (N, 8), which `lowering` has checked.
    """
    above, down = arm.group.forward(lower[0]), arm.group.forward(lower[-1])
    try:
        over = straight_path(arm.solver, arm.carrying(grasp, frozenset()), lifted, above)
        if float((np.abs(np.diff(over, axis=0)) / arm.limits.velocity).max(axis=1).sum()) > _WINDING_S:
            return None, lower
        return over, arm.straight(lowering, over[-1], down[:3, 3] - above[:3, 3])
    except (InCollisionError, PlanningError):
        return None, lower


def carried(arm: ArmPlanner, grasp: Grasp, start: FloatArray, goal: FloatArray, *, strict: bool = False) -> FloatArray:
    """Return a free way (N, 8) with the thing in the hand from start to goal, both (8,), the more upright the better.

    The hand does not go around beside the table lower than its top, unless it begins or ends there.

    Raises:
        PlanningError, InCollisionError: there is no way, however it leans; strict, none on which it leans little.
    """
    checker = arm.carrying(grasp, frozenset())
    least = max(lean(arm, grasp, start), lean(arm, grasp, goal)) + _MORE
    floor = min(arm.scene.table_z, *(float(arm.group.forward(q)[2, 3]) for q in (start, goal)))
    options = PlannerOptions(time_s=min(_TIME_S, arm.config.planning_time_s / 2.0))

    def plan_upright(limit: float) -> FloatArray:
        upright = UprightChecker(checker, grasp, max(limit, least), floor)
        return JointPlanner(upright, options).plan(start, [goal])

    leaning = PlanningError("there is no way on which it stays upright")
    for path in Alternatives(_LEANS, plan_upright, error=leaning, recoverable=(PlanningError,)):
        return path
    if strict:
        raise leaning
    return arm.transit(checker, start, [goal])
