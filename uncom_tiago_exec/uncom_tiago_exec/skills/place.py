# SPDX-License-Identifier: Apache-2.0
"""Placing: the object is taken and set down at a place, in an opening, or on top of something."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import ExecutionError, PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination, destination
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import TABLE_ONLY
from uncom_tiago_exec.planning.plan import Plan, Step
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.skills.grasping_skill import GraspingSkill
from uncom_tiago_exec.skills.motion_steps import Reach, placing_steps, taking_steps
from uncom_tiago_exec.skills.options import PLACE, PlaceOptions
from uncom_tiago_exec.skills.push import plan_push
from uncom_tiago_exec.skills.skill import PlanRequest
from uncom_tiago_exec.types import ManipulationTask

_INTO = (Primitive.PUT_IN,)
_ONTO = (Primitive.PUT_ON, Primitive.STACK)


class PlaceSkill(GraspingSkill):
    """Takes an object and sets it down; what no good grasp would hold is pushed there over the table."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.PLACE, *_INTO, *_ONTO)
    sets_down_held: ClassVar[bool] = True
    relay_primitive: ClassVar[Primitive | None] = Primitive.PLACE

    def __init__(self, options: PlaceOptions = PLACE) -> None:
        """Take what tunes the skill."""
        self.options = options

    def destination(self, task: ManipulationTask, scene: SceneModel) -> Destination:
        """Return where the object is to end: in or on the target, or at the place of the task.

        Raises:
            RefusedError: there is no place, it is off the table, or the object does not go there.
        """
        into, onto = task.primitive in _INTO, task.primitive in _ONTO
        return destination(task, scene.moved, scene.target, into=into, onto=onto)

    def plan(self, request: PlanRequest) -> Plan:
        """Plan by the best grasp, or by a push over the table where grasps are doubtful and that can be.

        Raises:
            RefusedError: it cannot be done; the text says why.
        """
        grasps = self.grasps(request)
        planners: list[Callable[[], Plan]] = [lambda: self.plan_with(request, grasps)]
        if self._is_pushed_rather(request, grasps):
            planners = [lambda: plan_push(request), *(planners if grasps else ())]
        error = PlanningError("there is no way to place it")
        return Alternatives(planners, lambda planner: planner(), error=error, recoverable=(ExecutionError,)).first()

    def _is_pushed_rather(self, request: PlanRequest, grasps: Sequence[Grasp]) -> bool:
        """Tell whether the object may be pushed to its place, and no grasp, or only doubtful ones, would hold it."""
        if request.goal is None or request.goal.touches != TABLE_ONLY:
            return False
        best = max((grasp.quality for grasp in grasps), default=0.0)
        return best <= (self.options.poor_quality_again if request.avoid else self.options.poor_quality)

    def steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return the steps to the object, to its place, and home."""
        taking = taking_steps(reach)
        return (*taking, *placing_steps(reach, reach.arm.start, reach.arm.start_gap, strict=strict))

    def rests_on_target(self, task: ManipulationTask) -> bool:
        """Tell whether the object must be seen on top of the target afterwards."""
        return task.primitive in _ONTO
