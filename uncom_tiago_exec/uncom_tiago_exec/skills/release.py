# SPDX-License-Identifier: Apache-2.0
"""Where a thing in the hand is let go: the place option that is quickly got to, and the straight ways down and out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError, UnreachableError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination, Place, place_options
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import straight_over
from uncom_tiago_exec.skills.reach import Reach

_PLACES = 3  # ways to let go that work, to choose the nearest of
_LOWERS = (0.1, 0.07, 0.04)


def let_go(arm: ArmPlanner, grasp: Grasp, goal: Destination, taken: Reach, effort: int) -> Reach:
    """Complete a reach by the place option that is quickly got to, among the first few that work."""
    carrying = arm.carrying(grasp, goal.touches)
    gap = min(grasp.opening, grasp.width + 0.03)
    error: ExecutionError = UnreachableError("place")
    options = iter(place_options(goal, arm.scene.moved, grasp, arm.group.gripper, coarse=effort == 0))
    while True:
        over_places, over_error = _over_places(arm, grasp, taken, carrying, options, effort)
        error = over_error or error
        for reach in sorted(over_places, key=Reach.hop):  # ways out are looked at last: each needs a scene anew
            try:
                return _left(replace(reach, release_gap=gap))
            except UnreachableError:
                continue
            except (InCollisionError, PlanningError) as err:
                error = err
        if not over_places:
            raise UnreachableError("place") if isinstance(error, UnreachableError) else error


def _over_places(
    arm: ArmPlanner,
    grasp: Grasp,
    taken: Reach,
    carrying: CollisionChecker,
    options: Iterator[Place],
    effort: int,
) -> tuple[list[Reach], ExecutionError | None]:
    """Return a reach for each of the next few options that the hand gets to, and what the last other failed by."""
    found: list[Reach] = []
    error: ExecutionError | None = None
    for place in options:
        try:
            q = arm.solver.solutions(place.hand, [taken.lift[-1], arm.start], carrying, restarts=effort)[0]
            lower = arm.lift_height(carrying, q, _LOWERS)[::-1]
            over, lower = straight_over(arm, grasp, taken.lift[-1], carrying, lower)
        except UnreachableError:
            continue
        except (InCollisionError, PlanningError) as err:
            error = err
            continue
        found.append(replace(taken, place=place, lower=lower, over=over))
        if len(found) == _PLACES or over is not None:
            break
    return found, error


def _left(reach: Reach) -> Reach:
    """Complete a reach by the straight way out after letting go."""
    arm, place, lower = reach.arm, reach.place, reach.lower
    if place is None or lower is None:
        raise PlanningError("there is no place to leave")
    leaving = arm.leaving(reach.release_gap, place.motion, frozenset({arm.scene.moved.name}))
    out = -max(reach.grasp.retreat, 0.08) * place.hand[:3, 0]
    return replace(reach, retreat=arm.straight(leaving, lower[-1], out))
