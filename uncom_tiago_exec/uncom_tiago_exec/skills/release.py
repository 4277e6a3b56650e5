# SPDX-License-Identifier: Apache-2.0
"""Where a held object is let go: the place option that is quickly got to, and the straight paths down and out."""

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
from uncom_tiago_exec.skills.options import RELEASE


def plan_release(arm: ArmPlanner, grasp: Grasp, goal: Destination, taken: Reach, effort: int) -> Reach:
    """Complete a reach by the place option that is quickly got to, among the first few that work."""
    carrying = arm.carrying(grasp, goal.touches)
    gap = min(grasp.opening, grasp.width + 0.03)

    def reach(place: Place) -> Reach:
        q = arm.solver.solutions(place.hand, [taken.lift[-1], arm.start], carrying, restarts=effort)[0]
        lower = arm.lift_path(carrying, q, RELEASE.heights_m)[::-1]
        over, lower = straight_transfer(arm, grasp, taken.lift[-1], carrying, lower)
        return replace(taken, place=place, lower=lower, over=over, release_gap=gap)

    options = place_candidates(goal, arm.scene.moved, grasp, arm.group.gripper, coarse=effort == 0)
    out_of_reach = (UnreachableError,)
    reached = Alternatives(options, reach, error=UnreachableError("place"), uninformative=out_of_reach)
    while few := _next_few(reached):
        quickest_first = sorted(few, key=Reach.hop)  # ways out are looked at last: each needs a scene anew
        left = Alternatives(quickest_first, _add_retreat, error=reached.error, uninformative=out_of_reach)
        for found in left:
            return found
        reached.error = left.error
    raise reached.error


def _next_few(reached: Iterator[Reach]) -> list[Reach]:
    """Return reaches of the next few places that the hand gets to; none is looked for after one straight over it."""
    few: list[Reach] = []
    for reach in reached:
        few.append(reach)
        if len(few) == RELEASE.enough or reach.over is not None:
            break
    return few


def _add_retreat(reach: Reach) -> Reach:
    """Complete a reach by the straight way out after letting go."""
    arm, place, lower = reach.arm, reach.place, reach.lower
    if place is None or lower is None:
        raise PlanningError("there is no place to leave")
    leaving = arm.leaving(reach.release_gap, place.motion, frozenset({arm.scene.moved.name}))
    out = -max(reach.grasp.retreat, 0.08) * place.hand[:3, 0]
    return replace(reach, retreat=arm.straight(leaving, lower[-1], out))
