# SPDX-License-Identifier: Apache-2.0
"""Finding what could be done from a little nearer to the table, or by way of its middle; nothing moves here."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError
from uncom_tiago_exec.execution.options import BASE_APPROACH, BaseApproachOptions
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.task_planner import TaskPlanner, middle_places_in_odom
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.base_frame import room_ahead, task_in_base
from uncom_tiago_exec.scene.scene_model import build_scene, replace_moved
from uncom_tiago_exec.skills.relay_via_middle import after_moving, to_middle
from uncom_tiago_exec.types import ManipulationTask

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
        options, best = self.options, None
        for distance in self._distances(task, first):
            try:
                plan = self._planner.plan(task, self._robot.base_pose().driven(distance))
            except ExecutionError as error:
                _LOG.debug("from %.2f m nearer: %s", distance, error)
                continue
            if is_good(plan) and (best is None or _quality(plan) > options.better_ratio * _quality(best.plan)):
                best = Approach(distance, plan)
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
        for place in middle_places_in_odom(task, base):
            first = to_middle(task, place, relay)
            try:
                plan = self._planner.plan(first, base)
            except ExecutionError as error:
                _LOG.debug("not by way of %s: %s", np.round(place, 2), error)
                continue
            second = task if plan.motion is None else after_moving(task, base.motion_in_odom(plan.motion))
            approach = self.find_plan(second)
            if approach is not None:
                return Relay(first, plan, second, approach)
        return None

    def find_drive_for_held(self, task: ManipulationTask, held: Plan) -> float | None:
        """Return how far to drive [m] so that what is held can be set down; it meets nothing on the way. Or None."""
        base = self._robot.base_pose()
        for distance in self._distances(task, 1):
            try:
                self._planner.plan_held(task, base.driven(distance), held)
            except ExecutionError as error:
                _LOG.debug("from %.2f m nearer: %s", distance, error)
                continue
            on_the_way = np.arange(0.0, distance, self.options.held_check_step_m)
            if all(self._is_free(task_in_base(task, base.driven(float(there))), held) for there in on_the_way):
                return distance
        return None

    def _distances(self, task: ManipulationTask, first: int) -> Iterator[float]:
        """Yield the distances, from an index on, that leave the front of the base before the table."""
        base = self._robot.base_pose()
        room = room_ahead(task_in_base(task, base).table) if self._config.drive_base else 0.0
        yield from (distance for distance in self.distances_m[first:] if distance <= room or distance == 0.0)

    def _is_free(self, task: ManipulationTask, held: Plan) -> bool:
        """Tell whether the arm as it is, with what it holds, touches nothing of a task in base_footprint."""
        if held.grasp is None:
            return False
        scene = replace_moved(build_scene(task), held.scene.moved)
        arm = ArmPlanner(self._planner.robot, held.side, self._robot.positions(), scene, self._config)
        checker, here = arm.carrying(held.grasp, frozenset()), arm.group.clamp(arm.start)
        return checker.is_free(here) or not checker.lower_margins_at(here)


def _quality(plan: Plan) -> float:
    """Return the quality of a plan's grasp, and 1 for a plan that needs none."""
    return 1.0 if plan.grasp is None else plan.grasp.quality
