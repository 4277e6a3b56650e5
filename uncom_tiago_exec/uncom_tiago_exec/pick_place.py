# SPDX-License-Identifier: Apache-2.0
"""The whole plan of a pick and place, found before anything moves.

Grasps of both arms are tried in the order of their worth; one counts only if the hand also gets to the place with it,
with straight ways in and out. Of the first few that work, the quickest is taken.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from uncom_tiago_exec.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.choosing import failure_of, in_order, refusal, same_grasp
from uncom_tiago_exec.collision import CollisionChecker
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import (
    ExecutionError,
    InCollisionError,
    PlanningError,
    RefusedError,
    UnreachableError,
)
from uncom_tiago_exec.grasps import Grasp, grasp_candidates
from uncom_tiago_exec.placing import Destination, Place, destination, place_options
from uncom_tiago_exec.plan import GripStep, MoveStep, Plan, Step
from uncom_tiago_exec.pushing import GAP, find_push
from uncom_tiago_exec.robot_model import RobotModel
from uncom_tiago_exec.scene_model import SceneModel, build_scene, replace_moved
from uncom_tiago_exec.straight import shortest_time
from uncom_tiago_exec.types import SIDES, FloatArray, ManipulationTask, Side, Stage

_LOG = logging.getLogger(__name__)
_ENOUGH = 3  # grasps that work, to choose the quickest of
_LIFTS = (0.12, 0.08, 0.05)
_LOWERS = (0.1, 0.07, 0.04)
_CONTACT = 0.05  # [rad, or m] joints that lag this far behind a slow motion are held up by something
PLACING = ("place", "put_in", "put_on", "stack")


@dataclass(frozen=True, slots=True)
class _Reach:
    """A grasp that works: joint paths for each straight part, and where it is let go."""

    arm: ArmPlanner
    grasp: Grasp
    approach: FloatArray
    lift: FloatArray
    place: Place | None = None
    lower: FloatArray | None = None
    retreat: FloatArray | None = None
    release_gap: float = 0.0

    @property
    def carrying_pace(self) -> float:
        """Share of the full pace at which the thing is carried: doubtful grasps are not shaken."""
        return float(np.clip(0.35 + 0.7 * self.grasp.quality, 0.5, 0.9))

    def cost(self) -> float:
        """Rough time of the free motions, dearer for doubtful grasps: what is lost costs more than a way [s]."""
        speed = self.arm.limits.velocity
        hops = [(self.arm.start, self.approach[0])]
        if self.lower is not None and self.retreat is not None:
            hops += [(self.lift[-1], self.lower[0]), (self.retreat[-1], self.arm.start)]
        motion = sum(float((np.abs(b - a) / speed).max()) for a, b in hops)
        return float((motion + 3.0) / max(self.grasp.quality, 0.05) ** 1.5)


class PickPlacePlanner:
    """Plans tasks for a robot."""

    def __init__(self, robot: RobotModel, config: ExecutionConfig) -> None:
        """Keep robot and parameters."""
        self.robot = robot
        self.config = config

    def plan(self, task: ManipulationTask, positions: Mapping[str, float], avoid: Sequence[FloatArray] = ()) -> Plan:
        """Plan a task from the present joint positions and back to them.

        avoid holds hand poses (4, 4) that failed before: grasps nearer than 1.5 cm and 20 degrees are left out.

        Raises:
            RefusedError: it cannot be done; the text says why (out of reach, in the way, no place, ...).
        """
        started, began = time.monotonic(), time.thread_time()
        scene = build_scene(task)
        goal = destination(task, scene.moved, scene.target) if task.primitive in (*PLACING, "push") else None
        arms = {side: ArmPlanner(self.robot, side, positions, scene, self.config) for side in SIDES}
        if task.primitive == "push":
            return self._timed_plan(
                self._pushed(arms, scene, task, goal), started, {"push": time.thread_time() - began}
            )
        grasps = grasp_candidates(scene.moved, scene.neighbours, arms["left"].group.gripper)
        grasps = [g for g in grasps if not any(same_grasp(g.pose, bad) for bad in avoid)]
        if not grasps and goal is not None and goal.touches == TABLE_ONLY:
            return self._timed_plan(
                self._pushed(arms, scene, task, goal), started, {"push": time.thread_time() - began}
            )
        if not grasps:
            raise RefusedError(f"I see no way to take hold of the {task.object_text or 'object'}")
        found_at = time.thread_time()
        reaches = self._search(arms, grasps, goal, task)
        searched_at = time.thread_time()
        plan = self._connect(reaches, scene)
        timings = {
            "grasps": found_at - began,
            "search": searched_at - found_at,
            "connect": time.thread_time() - searched_at,
        }
        return self._timed_plan(plan, started, timings)

    def _timed_plan(self, plan: Plan, started: float, timings: Mapping[str, float]) -> Plan:
        seconds = {key: round(value, 4) for key, value in timings.items()}
        return replace(plan, planning_s=time.monotonic() - started, timings_s=seconds)

    def _pushed(
        self, arms: Mapping[Side, ArmPlanner], scene: SceneModel, task: ManipulationTask, goal: Destination | None
    ) -> Plan:
        """Plan to push the thing to its place."""
        if goal is None:
            raise RefusedError(f"I do not know where to push the {task.object_text or 'object'}")
        push = find_push(arms, scene, task, goal.xy)
        arm = push.arm
        free, pushing, away = arm.free(GAP), arm.pushing(GAP), arm.leaving(GAP, push.motion, frozenset())
        go = arm.transit(free, arm.group.clamp(arm.start), [push.down[0]])
        back = arm.transit(away, push.up[-1], [arm.group.clamp(arm.start)])
        steps: tuple[Step, ...] = (
            GripStep(Stage.APPROACHING, GAP, detail="opening the fingers"),
            _move(arm, Stage.APPROACHING, (go, free, 1.0), "to behind the object"),
            _move(arm, Stage.APPROACHING, (push.down, pushing, 0.8), "straight down"),
            _move(arm, Stage.TRANSFERRING, (push.along, pushing, 0.5), "pushing"),
            _move(arm, Stage.RETREATING, (push.up, pushing, 0.9), "straight up"),
            _move(arm, Stage.HOMING, (_end_at(back, arm.start), away, 1.0), "back to the start"),
            GripStep(Stage.HOMING, arm.start_gap, detail="fingers as before"),
        )
        return Plan(arm.side, steps, scene, None, push.motion)

    def _search(
        self,
        arms: Mapping[Side, ArmPlanner],
        grasps: Sequence[Grasp],
        goal: Destination | None,
        task: ManipulationTask,
    ) -> list[_Reach]:
        """Return the first few grasps that work from start to end, cheapest first."""
        deadline = time.thread_time() + self.config.planning_time_s  # a busy machine gets the same search
        found: list[_Reach] = []
        failures: Counter[str] = Counter()
        ordered = in_order(arms, grasps, goal)
        for effort in (0, 2):  # a quick look at all of them, then a thorough one
            for arm, grasp in ordered:
                if time.thread_time() > deadline or len(found) >= _ENOUGH:
                    break
                try:
                    found.append(self._reach(arm, grasp, goal, effort))
                except ExecutionError as error:
                    failures[failure_of(error)] += 1
            if found:
                break
        _LOG.debug("grasps that work: %d; others failed by %s", len(found), dict(failures))
        if not found:
            raise refusal(failures, task)
        return sorted(found, key=lambda reach: reach.cost())

    def _reach(self, arm: ArmPlanner, grasp: Grasp, goal: Destination | None, effort: int) -> _Reach:
        reaching = arm.reaching(grasp.opening)
        seeds = [arm.start] if arm.hint is None else [arm.hint, arm.start]
        try:
            solutions = arm.solver.solutions(grasp.pose, seeds, reaching, count=2 + 2 * effort, restarts=effort)
        except UnreachableError as error:
            raise UnreachableError("object") from error
        failure: ExecutionError = PlanningError("no straight way to the object")
        for q in solutions:
            try:
                approach = arm.straight(reaching, q, -grasp.retreat * grasp.approach)[::-1]
                lift = arm.lift_height(arm.carrying(grasp, TABLE_ONLY), q, _LIFTS)
                taken = _Reach(arm, grasp, approach, lift)
                reach = taken if goal is None else self._let_go(arm, grasp, goal, taken, effort)
            except (InCollisionError, PlanningError) as err:
                failure = err
                continue
            arm.hint = q
            return reach
        raise failure

    def _let_go(self, arm: ArmPlanner, grasp: Grasp, goal: Destination, taken: _Reach, effort: int) -> _Reach:
        """Complete a reach by the first place option that works."""
        carrying = arm.carrying(grasp, goal.touches)
        gap = min(grasp.opening, grasp.width + 0.03)
        error: ExecutionError = UnreachableError("place")
        for place in place_options(goal, arm.scene.moved, grasp, arm.group.gripper):
            try:
                q = arm.solver.solutions(place.hand, [taken.lift[-1], arm.start], carrying, restarts=effort)[0]
                lower = arm.lift_height(carrying, q, _LOWERS)[::-1]
                leaving = arm.leaving(gap, place.motion, frozenset({arm.scene.moved.name}))
                retreat = arm.straight(leaving, q, -max(grasp.retreat, 0.08) * grasp_direction(place))
                return _Reach(arm, grasp, taken.approach, taken.lift, place, lower, retreat, gap)
            except UnreachableError:
                continue
            except (InCollisionError, PlanningError) as err:
                error = err
        if isinstance(error, UnreachableError):
            raise UnreachableError("place")
        raise error

    def _connect(self, reaches: Sequence[_Reach], scene: SceneModel) -> Plan:
        """Plan the free motions between the straight parts of the best reach, or of the next one."""
        error: ExecutionError = PlanningError("no grasp was found")
        for reach in reaches:
            try:
                return Plan(
                    reach.arm.side, self._steps(reach), scene, reach.grasp, reach.place.motion if reach.place else None
                )
            except ExecutionError as err:
                error = err
        raise error

    def _steps(self, reach: _Reach) -> tuple[Step, ...]:
        arm, grasp = reach.arm, reach.grasp
        free, reaching = arm.free(grasp.opening), arm.reaching(grasp.opening)
        start = arm.group.clamp(arm.start)
        go = arm.transit(free, start, [reach.approach[0]])
        lifting = arm.carrying(grasp, TABLE_ONLY)
        steps: list[Step] = [
            GripStep(Stage.APPROACHING, grasp.opening, detail="opening the fingers"),
            _move(arm, Stage.APPROACHING, (go, free, 1.0), "to the object"),
            _move(arm, Stage.APPROACHING, (reach.approach, reaching, 0.8), "straight in"),
            GripStep(Stage.GRASPING, max(0.0, grasp.width - 0.02), holding=True, detail="closing the fingers"),
            _move(arm, Stage.LIFTING, (reach.lift, lifting, min(reach.carrying_pace, 0.75)), "straight up"),
        ]
        return (*steps, *_placing_steps(reach, arm.start, arm.start_gap))

    def plan_held(self, task: ManipulationTask, positions: Mapping[str, float], held: Plan) -> Plan:
        """Plan to set down what `held` has put into the hand, and to go to where that plan began.

        Raises:
            RefusedError: there is no place, or it cannot be reached; the text says why.
        """
        started, began = time.monotonic(), time.thread_time()
        if held.grasp is None:
            raise RefusedError("I hold nothing")
        scene = replace_moved(build_scene(task), held.scene.moved)
        goal = destination(task, scene.moved, scene.target)
        arm = ArmPlanner(self.robot, held.side, positions, scene, self.config)
        here = arm.group.clamp(arm.start)
        taken = _Reach(arm, held.grasp, here[None], np.vstack([here, here]))
        reach = self._let_go(arm, held.grasp, goal, taken, 2)
        steps = _placing_steps(reach, held.home, 0.0)
        plan = Plan(held.side, steps, scene, held.grasp, reach.place.motion if reach.place else None)
        return self._timed_plan(plan, started, {"held": time.thread_time() - began})


def _placing_steps(reach: _Reach, home: FloatArray, gap: float) -> tuple[Step, ...]:
    """Return the steps from the lifted thing to the arm at home (8,) with its fingers at a gap [m]."""
    if reach.place is None or reach.lower is None or reach.retreat is None:
        return ()
    arm, grasp = reach.arm, reach.grasp
    carrying = arm.carrying(grasp, frozenset())
    over = arm.transit(carrying, reach.lift[-1], [reach.lower[0]])
    touches = frozenset({arm.scene.moved.name})
    leaving = arm.leaving(reach.release_gap, reach.place.motion, touches)
    away = arm.leaving(reach.release_gap, reach.place.motion, frozenset())
    goal = arm.group.clamp(home)
    if not away.is_free(goal):
        away.relax_at(goal)
    back = arm.transit(away, reach.retreat[-1], [goal])
    lowering = arm.carrying(grasp, reach.place.touches)
    down = _move(arm, Stage.PLACING, (reach.lower, lowering, min(reach.carrying_pace, 0.6)), "straight down")
    return (
        _move(arm, Stage.TRANSFERRING, (over, carrying, min(reach.carrying_pace, 0.8)), "to the place"),
        _until_contact(down),
        GripStep(Stage.PLACING, reach.release_gap, detail="letting go"),
        _move(arm, Stage.RETREATING, (reach.retreat, leaving, 0.9), "straight out"),
        _move(arm, Stage.HOMING, (_end_at(back, home), away, 1.0), "back to the start"),
        GripStep(Stage.HOMING, gap, detail="fingers as before"),
    )


def _until_contact(step: MoveStep) -> MoveStep:
    """Let a motion end where something holds it up: what turned between the fingers rests earlier."""
    return replace(step, trajectory=replace(step.trajectory, tolerance=_CONTACT))


def _move(arm: ArmPlanner, stage: Stage, way: tuple[FloatArray, CollisionChecker, float], detail: str) -> MoveStep:
    """Time a path (N, 8) under its checker at a pace, and say how short its time could be."""
    path, checker, pace = way
    limits = arm.limits
    least = shortest_time(path[0], path[-1], (limits.velocity, limits.acceleration, limits.jerk))
    return MoveStep(stage, arm.timed(path, checker, pace), detail, least)


def grasp_direction(place: Place) -> FloatArray:
    """Return the approach direction (3,) of the hand at a place."""
    return place.hand[:3, 0]


def _end_at(path: FloatArray, q: FloatArray) -> FloatArray:
    """Return the path with its end set to the true start, which noise may have put outside the limits."""
    return np.vstack([path[:-1], q])
