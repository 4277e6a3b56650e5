# SPDX-License-Identifier: Apache-2.0
"""Where a held object is released: the pose at the place, and the straight paths down to it and out of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from uncom_tiago_exec.exceptions import PlanningError, UnreachableError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination, Place, place_candidates
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import straight_transfer
from uncom_tiago_exec.skills.motion_steps import Reach
from uncom_tiago_exec.skills.options import RELEASE, ReleaseOptions


def plan_release(
    arm: ArmPlanner,
    grasp: Grasp,
    goal: Destination,
    lifted: Reach,
    effort: int,
    options: ReleaseOptions = RELEASE,
) -> Reach:
    """Add to a lifted object's reach the release of least transfer time, of the first few that work.

    Raises:
        UnreachableError: of "place".
        InCollisionError, PlanningError: something is in the way of a straight path.
    """
    carrying = arm.carry_checker(grasp, goal.touches)
    gap = min(grasp.opening, grasp.width + options.opening_m)

    def reach(place: Place) -> Reach:
        q = arm.solver.solutions(place.hand, [lifted.lift[-1], arm.start], carrying, restarts=effort)[0]
        lower = arm.lift_path(carrying, q, options.heights_m)[::-1]
        over, lower = straight_transfer(arm, grasp, lifted.lift[-1], carrying, lower)
        return replace(lifted, place=place, lower=lower, over=over, release_gap=gap)

    candidates = place_candidates(goal, arm.scene.moved, grasp, arm.group.gripper, coarse=effort == 0)
    out_of_reach = (UnreachableError,)
    reached = Alternatives(candidates, reach, error=UnreachableError("place"), uninformative=out_of_reach)
    while few := _next_few(reached, options.enough):
        quickest_first = sorted(few, key=Reach.hop)  # retreats are planned last: each needs a scene anew
        complete = Alternatives(
            quickest_first,
            lambda reach_to_place: _add_retreat(reach_to_place, options),
            error=reached.error,
            uninformative=out_of_reach,
        )
        for found in complete:
            return found
        reached.error = complete.error
    raise reached.error


def _next_few(reached: Iterator[Reach], count: int) -> list[Reach]:
    """Return reaches of the next few places that the hand gets to; none is looked for after one straight over it."""
    few: list[Reach] = []
    for reach in reached:
        few.append(reach)
        if len(few) == count or reach.over is not None:
            break
    return few


def _add_retreat(reach: Reach, options: ReleaseOptions) -> Reach:
    """Add the straight path of the opened hand away from the object to a reach."""
    arm, place, lower = reach.arm, reach.place, reach.lower
    if place is None or lower is None:
        raise PlanningError("there is no place to leave")
    leaving = arm.retreat_checker(reach.release_gap, place.motion, frozenset({arm.scene.moved.name}))
    out = -max(reach.grasp.retreat, options.least_retreat_m) * place.hand[:3, 0]
    return replace(reach, retreat=arm.straight(leaving, lower[-1], out))
