# SPDX-License-Identifier: Apache-2.0
"""Looking at the table again: where everything is now, and whether what was to be done is done."""

from __future__ import annotations

from uncom_common.transforms import apply
from uncom_perception.types import Scene

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import GraspFailedError, MisplacedError
from uncom_tiago_exec.execution.plan_executor import PlanExecutor
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.observation.object_reidentification import (
    update_task,
    update_task_unobstructed,
    with_remembered_objects,
)
from uncom_tiago_exec.observation.relation_measurement import expected_place
from uncom_tiago_exec.observation.verification import verify
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.base_frame import scene_in_odom, task_in_base
from uncom_tiago_exec.skills.skill import Skill
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage


class SceneObserver:
    """Looks through the robot's camera; tasks are in odom. `verification` is what the last check found, as data."""

    def __init__(self, robot: RobotInterface, config: ExecutionConfig, executor: PlanExecutor) -> None:
        """Take the robot that looks, whether to look at the end, and what reports the stages."""
        self._robot = robot
        self._config = config
        self._executor = executor
        self.verification: dict[str, object] = {}

    def look_for(self, task: ManipulationTask, plan: Plan | None = None) -> ManipulationTask:
        """Look again and follow the object to where it is now; see seen_again. What is out of sight is remembered.

        Raises:
            GraspFailedError: it is not seen.
        """
        found = self.seen_again(task, plan)
        if found is None:
            raise GraspFailedError(f"I no longer see the {task.object_text or 'object'}")
        return with_remembered_objects(found, task)

    def seen_again(self, task: ManipulationTask, plan: Plan | None = None) -> ManipulationTask | None:
        """Look again; return the task with everything where it is now, or None if the object is not seen.

        It may be where it was, or where a plan was to bring it.
        """
        return update_task(task, self._look(), None if plan is None else _expected_in_odom(plan))

    def look_unobstructed(self, task: ManipulationTask) -> ManipulationTask:
        """Look again now that the arm is out of the way; return the task with what is seen now."""
        return update_task_unobstructed(task, self._look())

    def _look(self) -> Scene:
        """Return what is seen now, in odom."""
        seen = self._robot.look()
        return scene_in_odom(seen, self._robot.base_pose())

    def check(self, task: ManipulationTask, plan: Plan, skill: Skill) -> str:
        """Look again, and say where the object is; the skill says what is to be seen.

        Raises:
            MisplacedError: it is not where it was to be.
        """
        if not self._config.verify:
            return skill.done_text(task, "")
        self._executor.report(Stage.VERIFYING, "looking again")
        task, plan = skill.expected(task, plan)
        on_target = skill.rests_on_target(task)
        finding = verify(task_in_base(task, plan.base), plan, self._robot.look(), on_target=on_target)
        self.verification = data = finding.as_data()
        self._executor.report(Stage.VERIFYING, finding.text, plan.side, data)
        if not finding.success:
            raise MisplacedError(finding.text)
        moved = ", ".join(f"the {name} by {distance * 100:.0f} cm" for name, distance in finding.moved)
        return finding.text + (f"; I moved {moved}" if moved else "")


def _expected_in_odom(plan: Plan) -> FloatArray | None:
    """Return where in odom the centre (2,) of the object should be, or None if it is held."""
    place = expected_place(plan)
    return None if place is None else apply(plan.base.transform_base_to_odom, [*place, 0.0])[:2]
