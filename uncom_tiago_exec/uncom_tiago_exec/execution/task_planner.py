# SPDX-License-Identifier: Apache-2.0
"""Planning tasks that are given in odom, from where the base stands or would stand.

Here, and nowhere else, a task is brought into the base frame for planning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from uncom_common.transforms import apply

from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.base_frame import task_in_base
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.registry import SkillRegistry
from uncom_tiago_exec.skills.relay_via_middle import middle_places
from uncom_tiago_exec.types import BasePose, FloatArray, ManipulationTask


class TaskPlanner:
    """Plans from the robot's present joint positions and a pose of its base."""

    def __init__(self, planner: ManipulationPlanner, robot: RobotInterface) -> None:
        """Take what plans in the base frame, and the robot whose joint positions plans begin at."""
        self._planner = planner
        self._robot = robot

    @property
    def robot(self) -> RobotModel:
        """The model that plans are made for."""
        return self._planner.robot

    @property
    def skills(self) -> SkillRegistry:
        """The skills that there are."""
        return self._planner.skills

    def plan(
        self, task: ManipulationTask, base: BasePose, avoid: Sequence[FloatArray] = (), like: Plan | None = None
    ) -> Plan:
        """Plan a task with the base at a pose; the plan is in base_footprint there. See ManipulationPlanner.plan.

        Raises:
            RefusedError: it cannot be done from there.
        """
        plan = self._planner.plan(task_in_base(task, base), self._robot.positions(), avoid, like)
        return replace(plan, base=base)

    def plan_held(self, task: ManipulationTask, base: BasePose, held: Plan) -> Plan:
        """Plan to set down, with the base at a pose, what a plan has put into the hand. See the planner's.

        Raises:
            RefusedError: there is no place, or it cannot be reached from there.
        """
        plan = self._planner.plan_held(task_in_base(task, base), self._robot.positions(), held)
        return replace(plan, base=base)


def middle_places_in_odom(task: ManipulationTask, base: BasePose) -> list[FloatArray]:
    """Return free places (2,) in odom that both arms reach with the base at a pose; see middle_places."""
    transform = base.transform_base_to_odom
    return [apply(transform, [*place, 0.0])[:2] for place in middle_places(task_in_base(task, base))]
