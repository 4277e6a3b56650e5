# SPDX-License-Identifier: Apache-2.0
"""The search for grasps that work from start to end."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import islice

from uncom_tiago_exec.exceptions import ExecutionError, PlanningError, UnreachableError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives, Record
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.skills.grasp_ordering import failure_of, refusal, same_grasp
from uncom_tiago_exec.skills.options import GRASP_SEARCH
from uncom_tiago_exec.skills.reach import Reach
from uncom_tiago_exec.skills.release import let_go
from uncom_tiago_exec.skills.skill import PlanRequest
from uncom_tiago_exec.types import FloatArray

_LOG = logging.getLogger(__name__)


def search_grasps(ordered: Sequence[tuple[ArmPlanner, Grasp]], request: PlanRequest) -> list[Reach]:
    """Return the first few grasps that work from start to end, cheapest first.

    Raises:
        RefusedError: none does; the text says what most of them failed by.
    """
    deadline_s = time.thread_time() + request.config.planning_time_s
    found: list[Reach] = []
    failures: Counter[str] = Counter()
    for effort in GRASP_SEARCH.efforts:
        search = _search_with(effort, ordered, request, deadline_s)
        found = list(islice(search, GRASP_SEARCH.enough))
        failures.update(failure_of(error) for _, error in search.failures)
        if found:
            break
    _LOG.debug("grasps that work: %d; others failed by %s", len(found), dict(failures))
    if not found:
        raise refusal(failures, request.task)
    return sorted(found, key=lambda reach: reach.cost())


def _search_with(
    effort: int, ordered: Sequence[tuple[ArmPlanner, Grasp]], request: PlanRequest, deadline_s: float
) -> Alternatives[tuple[ArmPlanner, Grasp], Reach]:
    """Return the search among pairs of arm and grasp with an effort; a quick one leaves out those like a failed one."""

    def different() -> Iterator[tuple[ArmPlanner, Grasp]]:
        for arm, grasp in ordered:
            failed = [one.pose for (other, one), _ in search.failures if other.side == arm.side]
            if effort > 0 or not any(same_grasp(grasp.pose, pose) for pose in failed):
                yield arm, grasp

    def name(option: tuple[ArmPlanner, Grasp]) -> str:
        arm, grasp = option
        return f"{arm.side}, {grasp.family}, quality {grasp.quality:.2f}"

    search = Alternatives(
        different(),
        lambda option: _reach(*option, request.goal, effort),
        error=PlanningError("no grasp was tried"),
        recoverable=(ExecutionError,),
        deadline_s=deadline_s,
        record=Record(request.log, f"grasps, {'quick' if effort == 0 else 'thorough'} look", name, failure_of),
    )
    return search


def _reach(arm: ArmPlanner, grasp: Grasp, goal: Destination | None, effort: int) -> Reach:
    """Plan the straight paths of a grasp: in, up, and where there is a destination down and out there.

    Raises:
        UnreachableError: of "object" or "place".
        InCollisionError, PlanningError: something is in the way of a straight path.
    """
    reaching = arm.reaching(grasp.opening)
    seeds = [arm.start] if arm.last_reaching is None else [arm.last_reaching, arm.start]
    try:
        solutions = arm.solver.solutions(grasp.pose, seeds, reaching, count=2 + 2 * effort, restarts=effort)
    except UnreachableError as error:
        raise UnreachableError("object") from error

    def reach(q: FloatArray) -> Reach:
        approach = arm.straight(reaching, q, -grasp.retreat * grasp.approach)[::-1]
        lift = arm.lift_height(arm.carrying(grasp, TABLE_ONLY), q, _lift_heights(arm, goal))
        taken = Reach(arm, grasp, approach, lift)
        found = taken if goal is None else let_go(arm, grasp, goal, taken, effort)
        arm.last_reaching = q
        return found

    blocked = PlanningError("no straight way to the object")
    return Alternatives(solutions, reach, error=blocked, recoverable=BLOCKED).first()


def _lift_heights(arm: ArmPlanner, goal: Destination | None) -> tuple[float, ...]:
    """Return the heights to lift to [m], highest first; what is only to be held is lifted clear of everything."""
    rim = arm.scene.moved.rim
    if goal is not None:
        return GRASP_SEARCH.lift_heights_m
    if rim is not None and rim.radius > GRASP_SEARCH.wide_dish_m:
        return tuple(share * rim.radius for share in GRASP_SEARCH.dish_heights)
    return GRASP_SEARCH.hold_heights_m
