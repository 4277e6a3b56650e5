# SPDX-License-Identifier: Apache-2.0
"""The search for grasps that work from start to end: in which order, and how it is said why none works."""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

import numpy as np
from uncom_common.options import ROBOT

from uncom_tiago_exec.exceptions import (
    ExecutionError,
    InCollisionError,
    PlanningError,
    RefusedError,
    UnreachableError,
)
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives, Record
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.skills.motion_steps import Reach
from uncom_tiago_exec.skills.options import GRASP_ORDER, GRASP_SEARCH, GraspOrderOptions, GraspSearchOptions
from uncom_tiago_exec.skills.release import plan_release
from uncom_tiago_exec.skills.skill import PlanRequest
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Side

_LOG = logging.getLogger(__name__)


def search_grasps(
    ordered: Sequence[tuple[ArmPlanner, Grasp]], request: PlanRequest, options: GraspSearchOptions = GRASP_SEARCH
) -> list[Reach]:
    """Return the first few grasps that work from start to end, cheapest first.

    Raises:
        RefusedError: none does; the text says what most of them failed by.
    """
    deadline_s = time.thread_time() + request.config.planning_time_s
    found: list[Reach] = []
    failures: Counter[str] = Counter()
    for effort in options.efforts:
        search = _search_with(effort, ordered, request, deadline_s)
        found = list(islice(search, options.enough))
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
    reaching = arm.approach_checker(grasp.opening)
    seeds = [arm.start] if arm.last_grasp_configuration is None else [arm.last_grasp_configuration, arm.start]
    try:
        solutions = arm.solver.solutions(grasp.pose, seeds, reaching, count=2 + 2 * effort, restarts=effort)
    except UnreachableError as error:
        raise UnreachableError("object") from error

    def reach(q: FloatArray) -> Reach:
        approach = arm.straight(reaching, q, -grasp.retreat * grasp.approach)[::-1]
        lift = arm.lift_path(arm.carry_checker(grasp, TABLE_ONLY), q, _lift_heights(arm, goal))
        lifted = Reach(arm, grasp, approach, lift)
        found = lifted if goal is None else plan_release(arm, grasp, goal, lifted, effort)
        arm.last_grasp_configuration = q
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


def same_grasp(a: FloatArray, b: FloatArray, slack: float = 1.0, options: GraspOrderOptions = GRASP_ORDER) -> bool:
    """Tell whether two hand poses (4, 4) are nearer than `slack` times the distance and turn of the options."""
    turn = np.arccos(np.clip((np.trace(a[:3, :3].T @ b[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))
    return bool(np.linalg.norm(a[:3, 3] - b[:3, 3]) < options.alike_m * slack and turn < options.alike_rad * slack)


def rank_grasps(
    arms: Mapping[Side, ArmPlanner],
    grasps: Sequence[Grasp],
    goal: Destination | None,
    like: Plan | None = None,
    options: GraspOrderOptions = GRASP_ORDER,
) -> list[tuple[ArmPlanner, Grasp]]:
    """Sort pairs of arm and grasp by worth: quality, arm on the right side, hand not turned back to the robot.

    Grasps like that of an earlier plan, made for nearly the same scene, come first.
    """
    scored = []
    for side, arm in arms.items():
        sign = 1.0 if side == "left" else -1.0
        shoulder = np.array([options.shoulder_x_m, sign * ROBOT.shoulder_y_m])
        for grasp in grasps:
            at = grasp.pose[:2, 3]
            far = at if goal is None else max((at, goal.xy), key=lambda p: -sign * float(p[1]))
            crossing = max(0.0, -sign * float(far[1]))
            yaw = np.arctan2(-grasp.pose[0, 1], grasp.pose[1, 1])
            azimuth = np.arctan2(*(at - shoulder)[::-1])
            facing = options.least_facing + options.facing_weight * float(np.cos(yaw - azimuth))
            far_by = max(0.0, float(np.linalg.norm(at - shoulder)) - options.far_m)
            steep = far_by * max(0.0, -float(grasp.approach[2]) - options.steep)
            reachable = np.exp(-crossing / options.crossing_m) * np.exp(-options.steep_weight * steep)
            scored.append((grasp.quality**options.quality_power * facing * reachable, arm, grasp))
    known = like.grasp if like is not None else None
    if like is not None and known is not None:
        scored = [
            (
                worth + (arm.side == like.side and same_grasp(grasp.pose, known.pose, options.plan_slack, options)),
                arm,
                grasp,
            )
            for worth, arm, grasp in scored
        ]
    scored.sort(key=lambda item: -item[0])
    return [(arm, grasp) for _, arm, grasp in scored]


def failure_of(error: ExecutionError) -> str:
    """Return the kind of an error, to count."""
    if isinstance(error, UnreachableError):
        return "reach_place" if str(error) == "place" else "reach_object"
    if isinstance(error, InCollisionError):
        names = sorted({name for pair in error.contacts for name in pair if not name.startswith(("arm", "wrist"))})
        return "blocked:" + ",".join(n for n in names if "link" not in n)
    return "straight"


def refusal(failures: Counter[str], task: ManipulationTask) -> RefusedError:
    """Say in words what most grasps failed by."""
    what = task.object_text or task.object.label or "object"
    if not failures:
        return PlanningError(f"I found no way to take the {what} in time")
    if failures["reach_place"] and failures["reach_object"] < sum(failures.values()):
        where = f"put it at the {task.target_text}" if task.target_text else "put it there"
        return UnreachableError(f"I can take the {what}, but with the same arm I cannot reach far enough to {where}")
    worst = failures.most_common(1)[0][0]
    if worst == "reach_object":
        return UnreachableError(f"the {what} is out of reach of both arms")
    if worst.startswith("blocked:"):
        names = worst.removeprefix("blocked:").replace("object", f"the {what}") or "something"
        return InCollisionError(f"I cannot take or place the {what} without touching something ({names})")
    return PlanningError(f"I cannot move straight to the {what} and away again")
