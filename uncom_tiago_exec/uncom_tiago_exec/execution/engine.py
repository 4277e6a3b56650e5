# SPDX-License-Identifier: Apache-2.0
"""Carries out tasks on a robot: one tick of an execution tree for each.

Runs in a thread of its own and blocks there; it knows the robot only through RobotInterface.
"""

from __future__ import annotations

from py_trees.common import Status as TreeStatus

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.base_approach import BaseApproach
from uncom_tiago_exec.execution.base_driver import BaseDriver
from uncom_tiago_exec.execution.behaviours import tree_as_data
from uncom_tiago_exec.execution.execution_state import ExecutionState
from uncom_tiago_exec.execution.execution_tree import ExecutionTree
from uncom_tiago_exec.execution.held_object_actions import HeldObjectActions
from uncom_tiago_exec.execution.plan_executor import PlanExecutor, StatusCallback
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.scene_observer import SceneObserver
from uncom_tiago_exec.execution.task_actions import ExecutionParts, TaskActions
from uncom_tiago_exec.execution.task_planner import TaskPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.types import ManipulationTask, Outcome, Stage


class Engine:
    """Carries out one task at a time; it outlives a task, for it knows what is in the hand and where home is."""

    def __init__(
        self,
        model: RobotModel,
        robot: RobotInterface,
        config: ExecutionConfig,
        report: StatusCallback,
        planner: ManipulationPlanner | None = None,
    ) -> None:
        """Take the robot and its model; nothing moves yet.

        Args:
            model: of the robot.
            robot: the access to it.
            config: parameters of the node.
            report: called with every change of stage, in the thread that executes.
            planner: makes the plans; by default one with every skill that there is.
        """
        self.model = model
        planned_by = TaskPlanner(planner or ManipulationPlanner(model, config), robot)
        executor = PlanExecutor(model, robot, config, report)
        self._parts = ExecutionParts(
            model,
            robot,
            config,
            planned_by,
            BaseApproach(planned_by, robot, config),
            executor,
            BaseDriver(robot),
            SceneObserver(robot, config, executor),
        )
        self._state: ExecutionState | None = None

    def execute(self, task: ManipulationTask) -> Outcome:
        """Carry out a task in odom; every stage is reported, the last one is DONE, FAILED or STOPPED."""
        before, parts = self._state, self._parts
        parts.executor.stage, parts.observer.verification = Stage.IDLE, {}
        state = ExecutionState(task, task)
        if before is not None:
            state.under_way, state.unfinished = before.under_way, before.unfinished
        self._state = state
        root = ExecutionTree(TaskActions(state, parts), HeldObjectActions(state, parts)).build()
        root.tick_once()
        state.unfinished = self._left_unfinished(state, root.status)
        return self._end(state, tree_as_data(root), succeeded=root.status is TreeStatus.SUCCESS)

    def _left_unfinished(self, state: ExecutionState, status: TreeStatus) -> Plan | None:
        """Return the plan whose way home the next command begins with, or None if there is no need for it."""
        plan = None if state.under_way is None else state.under_way.plan
        if status is TreeStatus.SUCCESS or not (state.is_stopped or self._parts.is_astray(plan)):
            return None
        return plan

    def _end(self, state: ExecutionState, tree: dict[str, object], *, succeeded: bool) -> Outcome:
        """Report how the tree ended; a stage that was not the last one stays in the outcome, where it failed."""
        executor = self._parts.executor
        stage = Stage.DONE if succeeded else Stage.STOPPED if state.is_stopped else Stage.FAILED
        reached = stage if succeeded else executor.stage
        text = state.text if succeeded or state.failure is None else str(state.failure)
        executor.report(stage, text, data={"tree": tree})
        return Outcome(succeeded, reached, text, executor.in_hand, self._parts.observer.verification, tree)
