# SPDX-License-Identifier: Apache-2.0
"""Finding what could be done from a little nearer to the table, or by way of its middle; nothing moves here."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple, TypeVar

import numpy as np
from uncom_perception.types import TableSurface

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError, PlanningError, UnreachableError
from uncom_tiago_exec.execution.options import BASE_APPROACH, BaseApproachOptions
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.task_planner import TaskPlanner, middle_places_in_odom
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.base_frame import task_in_base
from uncom_tiago_exec.scene.scene_model import build_scene, replace_moved
from uncom_tiago_exec.skills.relay_via_middle import after_moving, to_middle
from uncom_tiago_exec.types import FloatArray, ManipulationTask

OptionT = TypeVar("OptionT", float, FloatArray)
ResultT = TypeVar("ResultT")
_LOG = logging.getLogger(__name__)


class Approach(NamedTuple):
    """How far the base is to drive straight on [m], and a plan from there."""

    distance_m: float
    plan: Plan


class Relay(NamedTuple):
    """A task in two halves: to the middle of the table, with its plan, and on from there once the base has driven."""

    first: ManipulationTask
    plan: Plan
    second: ManipulationTask
    approach: Approach


class BaseApproach:
    """Plans as if the base stood nearer than it does. All tasks are in odom."""

    def __init__(
        self,
        planner: TaskPlanner,
        robot: RobotInterface,
        config: ExecutionConfig,
        options: BaseApproachOptions = BASE_APPROACH,
    ) -> None:
        """Take the planner, the robot whose base would drive, and what is allowed."""
        self._planner = planner
        self._robot = robot
        self._config = config
        self.options = options

    @property
    def distances_m(self) -> tuple[float, ...]:
        """Distances that the base may drive, in the order in which they are tried; the first is none at all."""
        return (0.0, *self.options.distances_m)

    def find_plan(
        self, task: ManipulationTask, first: int = 0, is_good: Callable[[Plan], bool] = lambda _: True
    ) -> Approach | None:
        """Return as short a drive as will do for a good plan, or None if there is none.

        Where the grasp of that plan is a doubtful one a longer drive to a much better grasp is rather taken.

        Args:
            task: what is to be done.
            first: index of the shortest distance that is tried.
            is_good: tells whether a plan is good enough.
        """
        base, options, best = self._robot.base_pose(), self.options, None

        def plan_from(distance: float) -> Approach:
            return Approach(distance, self._planner.plan(task, base.driven(distance)))

        for approach in _tried(self._distances(task, first), plan_from):
            quality = _quality(approach.plan)
            if is_good(approach.plan) and (best is None or quality > options.better_ratio * _quality(best.plan)):
                best = approach
            if best is not None and _quality(best.plan) > options.doubtful_quality:
                break
        return best

    def find_better_grasp(self, task: ManipulationTask, plan: Plan) -> Approach | None:
        """Return a drive to a much better grasp than a plan's doubtful one; None if it is not doubtful, or none is."""
        quality, options = _quality(plan), self.options
        if quality > options.doubtful_quality:
            return None
        return self.find_plan(task, 1, lambda other: _quality(other) > options.better_ratio * quality)

    def find_relay(self, task: ManipulationTask) -> Relay | None:
        """Return a way by the middle of the table, from where the base stands; None if there is none."""
        relay = self._planner.skills[task.primitive].relay_primitive
        if relay is None:
            return None
        base = self._robot.base_pose()

        def by_way_of(place: FloatArray) -> Relay:
            first = to_middle(task, place, relay)
            plan = self._planner.plan(first, base)
            second = task if plan.motion is None else after_moving(task, base.motion_in_odom(plan.motion))
            approach = self.find_plan(second)
            if approach is None:
                raise UnreachableError("there is no way on from there")
            return Relay(first, plan, second, approach)

        return next(_tried(middle_places_in_odom(task, base), by_way_of), None)

    def find_drive_for_held(self, task: ManipulationTask, held: Plan) -> float | None:
        """Return how far to drive [m] so that what is held can be set down; it meets nothing on the way. Or None."""
        base = self._robot.base_pose()

        def set_down_from(distance: float) -> float:
            self._planner.plan_held(task, base.driven(distance), held)
            return distance

        for distance in _tried(self._distances(task, 1), set_down_from):
            on_the_way = np.arange(0.0, distance, self.options.held_check_step_m)
            if all(self._is_free(task_in_base(task, base.driven(float(there))), held) for there in on_the_way):
                return distance
        return None

    def _distances(self, task: ManipulationTask, first: int) -> Iterator[float]:
        """Yield the distances, from an index on, that leave the front of the base before the table."""
        base = self._robot.base_pose()
        room = room_ahead(task_in_base(task, base).table, self.options) if self._config.drive_base else 0.0
        yield from (distance for distance in self.distances_m[first:] if distance <= room or distance == 0.0)

    def _is_free(self, task: ManipulationTask, held: Plan) -> bool:
        """Tell whether the arm as it is, with what it holds, touches nothing of a task in base_footprint."""
        if held.grasp is None:
            return False
        scene = replace_moved(build_scene(task), held.scene.moved)
        arm = ArmPlanner(self._planner.robot, held.side, self._robot.positions(), scene, self._config)
        checker, here = arm.carry_checker(held.grasp, frozenset()), arm.group.clamp(arm.start)
        return checker.is_free(here) or not checker.lower_margins_at(here)


def _tried(options: Iterable[OptionT], attempt: Callable[[OptionT], ResultT]) -> Iterator[ResultT]:
    """Yield what succeeds of a search; whatever else is raised, nothing has moved."""
    alternatives = Alternatives(
        options, attempt, error=PlanningError("nothing could be tried"), recoverable=(ExecutionError,)
    )
    yield from alternatives
    for option, error in alternatives.failures:
        _LOG.debug("not from, or by way of, %s: %s", np.round(option, 2), error)


def _quality(plan: Plan) -> float:
    """Return the quality of a plan's grasp, and 1 for a plan that needs none."""
    return 1.0 if plan.grasp is None else plan.grasp.quality


def room_ahead(table: TableSurface | None, options: BaseApproachOptions = BASE_APPROACH) -> float:
    """Return how far the base can drive before its front is under the edge of a table in base_footprint [m]."""
    if table is None or len(table.polygon) == 0:
        return 0.0
    return float(np.asarray(table.polygon)[:, 0].min()) - options.front_m
