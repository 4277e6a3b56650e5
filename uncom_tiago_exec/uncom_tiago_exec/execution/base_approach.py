# SPDX-License-Identifier: Apache-2.0
"""What could be done from a little nearer to the table; nothing moves here."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.task_planner import TaskPlanner, middle_places_in_odom
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.base_frame import room_ahead, task_in_base
from uncom_tiago_exec.scene.scene_model import build_scene, replace_moved
from uncom_tiago_exec.skills.relay_via_middle import after_moving, to_middle
from uncom_tiago_exec.types import ManipulationTask

STEPS = (0.06, 0.12)  # [m] tried in this order
_LOG = logging.getLogger(__name__)
_DOUBTFUL = 0.2  # quality of a grasp below which it is worth a short drive to find a better one
_SURER = 2.0  # times as good
_EVERY = 0.02  # [m] of a drive, where what is held is looked at


def _quality(plan: Plan) -> float:
    """Return the quality of a plan's grasp; what needs none is sure."""
    return 1.0 if plan.grasp is None else plan.grasp.quality


class FromNearer:
    """Plans as if the base stood nearer than it does. All tasks are in odom."""

    def __init__(self, planner: TaskPlanner, robot: RobotInterface, config: ExecutionConfig) -> None:
        """Take the planner, the robot whose base would drive, and what is allowed."""
        self.planner = planner
        self._robot = robot
        self._config = config

    def _steps(self, task: ManipulationTask, least: int) -> Iterator[float]:
        room = room_ahead(task_in_base(task, self._robot.base_pose()).table) if self._config.drive_base else 0.0
        yield from (ahead for ahead in (0.0, *STEPS)[least:] if ahead <= room or ahead == 0.0)

    def reaching(
        self, task: ManipulationTask, least: int = 0, good: Callable[[Plan], bool] = lambda _: True
    ) -> tuple[float, Plan] | None:
        """Return how far to drive [m] so that a good plan is found, as little as will do, with it; or None.

        Where its grasp is a doubtful one a longer drive to a much better one is rather taken.
        """
        best: tuple[float, Plan] | None = None
        for ahead in self._steps(task, least):
            try:
                plan = self.planner.plan(task, self._robot.base_pose().driven(ahead))
            except ExecutionError as error:
                _LOG.debug("from %.2f m nearer: %s", ahead, error)
                continue
            if good(plan) and (best is None or _quality(plan) > _SURER * _quality(best[1])):
                best = ahead, plan
            if best is not None and _quality(best[1]) > _DOUBTFUL:
                break
        return best

    def by_the_middle(
        self, task: ManipulationTask
    ) -> tuple[ManipulationTask, Plan, ManipulationTask, tuple[float, Plan]] | None:
        """Return the first half with its plan, the rest as it will be then, and how that is reached; or None."""
        relay = self.planner.skills[task.primitive].relay_primitive
        if relay is None:
            return None
        base = self._robot.base_pose()
        for place in middle_places_in_odom(task, base):
            half = to_middle(task, place, relay)
            try:
                plan = self.planner.plan(half, base)
            except ExecutionError as error:
                _LOG.debug("not by way of %s: %s", np.round(place, 2), error)
                continue
            rest = task if plan.motion is None else after_moving(task, base.motion_in_odom(plan.motion))
            then = self.reaching(rest)
            if then is not None:
                return half, plan, rest, then
        return None

    def surer(self, task: ManipulationTask, plan: Plan) -> tuple[float, Plan] | None:
        """Return how far to drive [m] for a much better grasp than a plan's doubtful one, with its plan; or None."""
        now = _quality(plan)
        return None if now > _DOUBTFUL else self.reaching(task, 1, lambda p: _quality(p) > _SURER * now)

    def for_held(self, task: ManipulationTask, held: Plan) -> float | None:
        """Return how far to drive [m] so that what is held can be set down; it meets nothing on the way. Or None."""
        base = self._robot.base_pose()
        for ahead in self._steps(task, 1):
            try:
                self.planner.plan_held(task, base.driven(ahead), held)
            except ExecutionError as error:
                _LOG.debug("from %.2f m nearer: %s", ahead, error)
                continue
            if all(self._is_free(task_in_base(task, base.driven(on)), held) for on in np.arange(0.0, ahead, _EVERY)):
                return ahead
        return None

    def _is_free(self, task: ManipulationTask, held: Plan) -> bool:
        """Tell whether the arm as it is, with what it holds, touches nothing."""
        if held.grasp is None:
            return False
        scene = replace_moved(build_scene(task), held.scene.moved)
        arm = ArmPlanner(self.planner.robot, held.side, self._robot.positions(), scene, self._config)
        checker, here = arm.carrying(held.grasp, frozenset()), arm.group.clamp(arm.start)
        return checker.is_free(here) or not checker.relax_at(here)
