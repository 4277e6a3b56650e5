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
from dataclasses import replace

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import (
    ExecutionError,
    InCollisionError,
    PlanningError,
    RefusedError,
    UnreachableError,
)
from uncom_tiago_exec.grasping.grasps import Grasp, grasp_candidates
from uncom_tiago_exec.grasping.place_poses import Destination, destination
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY, ArmPlanner
from uncom_tiago_exec.planning.plan import Plan, Step
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.occlusion import shadows_of
from uncom_tiago_exec.scene.scene_model import SceneModel, build_scene, replace_moved
from uncom_tiago_exec.skills.grasp_ordering import failure_of, in_order, refusal, same_grasp
from uncom_tiago_exec.skills.pick_place_steps import (
    Reach,
    giving_steps,
    placing_steps,
    pointing_steps,
    pouring_steps,
    taking_steps,
)
from uncom_tiago_exec.skills.point_and_give import pointing
from uncom_tiago_exec.skills.pour import find_pour
from uncom_tiago_exec.skills.push import find_pushes, pushing_steps
from uncom_tiago_exec.skills.release import let_go
from uncom_tiago_exec.types import SIDES, FloatArray, ManipulationTask, Side

_LOG = logging.getLogger(__name__)
_ENOUGH = 3  # grasps that work, to choose the quickest of
_LIFTS: tuple[float, ...] = (0.12, 0.08, 0.05)
_WINDING = 1.9  # times the least that its motions could take, beyond which another grasp is looked at
_STEEP, _STEEPEST = -0.8, -0.9  # least z of an approach direction for pouring, and where there is no other
_CLEAR: tuple[float, ...] = (0.12, 0.1, 0.08)  # of what is only to be held
_HIGHER = (2.5, 2.1, 1.7)  # radii of wide dishes that are to be held: they hang down from their edge
_WIDE = 0.06  # [m] radius of such a dish
_POOR = 0.15  # quality of grasps below which a thing is rather pushed where it can be, and once one has failed
_POOR_AGAIN = 0.35
PLACING = ("place", "put_in", "put_on", "stack")


class PickPlacePlanner:
    """Plans tasks for a robot."""

    def __init__(self, robot: RobotModel, config: ExecutionConfig) -> None:
        """Keep robot and parameters."""
        self.robot = robot
        self.config = config

    def plan(
        self,
        task: ManipulationTask,
        positions: Mapping[str, float],
        avoid: Sequence[FloatArray] = (),
        like: Plan | None = None,
    ) -> Plan:
        """Plan a task from the present joint positions and back to them.

        avoid holds hand poses (4, 4) that failed before: grasps nearer than 1.5 cm and 20 degrees are left out.
        What is like the grasp of an earlier plan, one for nearly the same scene, is tried first.

        Raises:
            RefusedError: it cannot be done; the text says why (out of reach, in the way, no place, ...).
        """
        started = time.monotonic()
        scene = build_scene(task)
        goal = destination(task, scene.moved, scene.target) if task.primitive in (*PLACING, "push", "pour") else None
        shadows = shadows_of(scene, self.robot.camera(positions), None if goal is None else goal.xy)
        if shadows:
            careful = replace(scene, shadows=shadows)
            try:
                plan = self._plan_in(careful, task, positions, goal, avoid, like, started)
            except (InCollisionError, PlanningError) as error:
                _LOG.debug("not without going where nothing is seen: %s", error)
            else:
                return replace(plan, scene=scene)
        return self._plan_in(scene, task, positions, goal, avoid, like, started)

    def _plan_in(
        self,
        scene: SceneModel,
        task: ManipulationTask,
        positions: Mapping[str, float],
        goal: Destination | None,
        avoid: Sequence[FloatArray],
        like: Plan | None,
        started: float,
    ) -> Plan:
        """Plan a task in a scene."""
        began = time.thread_time()
        arms = {side: ArmPlanner(self.robot, side, positions, scene, self.config) for side in SIDES}
        if task.primitive == "push":
            return self._timed_plan(
                self._pushed(arms, scene, task, goal), started, {"push": time.thread_time() - began}
            )
        if task.primitive == "point":
            return self._timed_plan(self._pointed(arms, scene), started, {"point": time.thread_time() - began})
        grasps = grasp_candidates(scene.moved, scene.neighbours, arms["left"].group.gripper)
        grasps = [g for g in grasps if not any(same_grasp(g.pose, bad) for bad in avoid)]
        if task.primitive == "pour":  # what is held from straight above cannot be tilted far
            grasps = [g for g in grasps if g.family == "across" and g.approach[2] > _STEEPEST]
        pushed = self._rather_pushed(arms, scene, task, goal, grasps, bool(avoid))
        if pushed is not None:
            return self._timed_plan(pushed, started, {"push": time.thread_time() - began})
        if not grasps:
            raise RefusedError(f"I see no way to take hold of the {task.object_text or 'object'}")
        found_at = time.thread_time()
        reaches = self._reaches(in_order(arms, grasps, goal, like), goal, task)
        searched_at = time.thread_time()
        plan = self._connect(reaches, scene, task)
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
        error: ExecutionError = PlanningError("no push was found")
        pushes = find_pushes(arms, scene, task, goal.xy)
        for push, turned in ((push, turned) for turned in (True, True, False) for push in pushes):
            try:
                return Plan(push.arm.side, pushing_steps(push, turned=turned), scene, None, push.motion)
            except ExecutionError as err:
                error = err
        raise error

    def _rather_pushed(
        self,
        arms: Mapping[Side, ArmPlanner],
        scene: SceneModel,
        task: ManipulationTask,
        goal: Destination | None,
        grasps: Sequence[Grasp],
        again: bool,
    ) -> Plan | None:
        """Plan to push over the table what no grasp, or only doubtful ones, would hold; None if that is not so.

        Raises:
            RefusedError: it cannot be pushed there, and there is no grasp either.
        """
        if task.primitive not in PLACING or goal is None or goal.touches != TABLE_ONLY:
            return None
        if max((g.quality for g in grasps), default=0.0) > (_POOR_AGAIN if again else _POOR):
            return None
        try:
            return self._pushed(arms, scene, task, goal)
        except ExecutionError:
            if not grasps:
                raise
            return None

    def _pointed(self, arms: Mapping[Side, ArmPlanner], scene: SceneModel) -> Plan:
        """Plan to point at the thing with closed fingers, and to come back."""
        arm, q = pointing(arms, scene)
        return Plan(arm.side, pointing_steps(arm, q), scene)

    def _reaches(
        self, ordered: Sequence[tuple[ArmPlanner, Grasp]], goal: Destination | None, task: ManipulationTask
    ) -> list[Reach]:
        """Search; for pouring among the less steep grasps first."""
        flat = [(arm, grasp) for arm, grasp in ordered if grasp.approach[2] > _STEEP]
        if task.primitive == "pour" and flat:
            try:
                return self._search(flat, goal, task)
            except RefusedError:
                _LOG.debug("what is to be poured cannot be held from the side")
        return self._search(ordered, goal, task)

    def _search(
        self, ordered: Sequence[tuple[ArmPlanner, Grasp]], goal: Destination | None, task: ManipulationTask
    ) -> list[Reach]:
        """Return the first few grasps that work from start to end, cheapest first."""
        deadline = time.thread_time() + self.config.planning_time_s  # a busy machine gets the same search
        found: list[Reach] = []
        failures: Counter[str] = Counter()
        for effort in (0, 2):  # a quick look at different ones, then a thorough one at all of them
            missed: list[tuple[Side, FloatArray]] = []
            for arm, grasp in ordered:
                if time.thread_time() > deadline or len(found) >= _ENOUGH:
                    break
                if effort == 0 and any(side == arm.side and same_grasp(grasp.pose, pose) for side, pose in missed):
                    continue
                try:
                    found.append(self._reach(arm, grasp, goal, effort))
                except ExecutionError as error:
                    failures[failure_of(error)] += 1
                    missed.append((arm.side, grasp.pose))
            if found:
                break
        _LOG.debug("grasps that work: %d; others failed by %s", len(found), dict(failures))
        if not found:
            raise refusal(failures, task)
        return sorted(found, key=lambda reach: reach.cost())

    def _reach(self, arm: ArmPlanner, grasp: Grasp, goal: Destination | None, effort: int) -> Reach:
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
                rim, lifts = arm.scene.moved.rim, _LIFTS if goal is not None else _CLEAR
                if goal is None and rim is not None and rim.radius > _WIDE:
                    lifts = tuple(share * rim.radius for share in _HIGHER)
                lift = arm.lift_height(arm.carrying(grasp, TABLE_ONLY), q, lifts)
                taken = Reach(arm, grasp, approach, lift)
                reach = taken if goal is None else let_go(arm, grasp, goal, taken, effort)
            except (InCollisionError, PlanningError) as err:
                failure = err
                continue
            arm.hint = q
            return reach
        raise failure

    def _connect(self, reaches: Sequence[Reach], scene: SceneModel, task: ManipulationTask) -> Plan:
        """Plan the free motions between the straight parts of the best reach, or of another if those wind."""
        error: ExecutionError = PlanningError("no grasp was found")
        best: tuple[float, Plan] | None = None
        for strict in (True, False):
            for reach in reaches:
                try:
                    steps = self._steps(reach, task, strict=strict)
                except ExecutionError as err:
                    error = err
                    continue
                place = reach.place
                plan = Plan(reach.arm.side, steps, scene, reach.grasp, place.motion if place else None)
                if plan.duration_s <= _WINDING * plan.shortest_s:
                    return plan
                cost = plan.duration_s / max(reach.grasp.quality, 0.05)
                if best is None or cost < best[0]:
                    best = cost, plan
            if best is not None:
                return best[1]
        raise error

    def _steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return a reach's steps; strict, only if the thing stays upright on its way."""
        taking = taking_steps(reach)
        if task.primitive == "give":
            return (*taking, *giving_steps(reach))
        if task.primitive == "pour":
            names = task.object_text or task.object.label or "object", task.target_text or "target"
            pour = find_pour(reach.arm, reach.grasp, reach.lift[-1], names, strict=strict)
            upright = replace(reach, lift=np.vstack([reach.lift[-1], pour.over[-1]]), over=None)
            back = placing_steps(upright, reach.arm.start, reach.arm.start_gap, strict=strict)
            return (*taking, *pouring_steps(reach, pour), *back)
        return (*taking, *placing_steps(reach, reach.arm.start, reach.arm.start_gap, strict=strict))

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
        taken = Reach(arm, held.grasp, here[None], np.vstack([here, here]))
        reach = let_go(arm, held.grasp, goal, taken, 2)
        steps = placing_steps(reach, held.home, 0.0)
        plan = Plan(held.side, steps, scene, held.grasp, reach.place.motion if reach.place else None)
        return self._timed_plan(plan, started, {"held": time.thread_time() - began})
