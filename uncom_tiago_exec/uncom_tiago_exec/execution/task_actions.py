# SPDX-License-Identifier: Apache-2.0
"""What the leaves of the tree do to carry out a task with empty hands."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import (
    ExecutionError,
    GraspFailedError,
    MisplacedError,
    MotionError,
    PlanningError,
)
from uncom_tiago_exec.execution.base_approach import BaseApproach
from uncom_tiago_exec.execution.base_driver import BaseDriver
from uncom_tiago_exec.execution.execution_state import ExecutionState, PlanUnderWay
from uncom_tiago_exec.execution.plan_executor import PlanExecutor
from uncom_tiago_exec.execution.recovery import is_away_from_home
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.scene_observer import SceneObserver
from uncom_tiago_exec.execution.task_planner import TaskPlanner
from uncom_tiago_exec.planning.alternatives import RECOVERABLE
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.skills.skill import ObjectEnd
from uncom_tiago_exec.types import Stage


@dataclass(frozen=True, slots=True)
class ExecutionParts:
    """What actions use: each part outlasts a command."""

    model: RobotModel
    robot: RobotInterface
    config: ExecutionConfig
    planner: TaskPlanner
    approach: BaseApproach
    executor: PlanExecutor
    base: BaseDriver
    observer: SceneObserver

    def is_astray(self, plan: Plan | None) -> bool:
        """Tell whether the arm of a plan is elsewhere than at home, or may be: joint states fell silent."""
        try:
            return plan is not None and is_away_from_home(self.model, plan, self.robot.positions())
        except MotionError:
            return True


class TaskActions:
    """Actions on the state of one command."""

    def __init__(self, state: ExecutionState, parts: ExecutionParts) -> None:
        """Take the state that the actions change, and what they use."""
        self.state = state
        self.parts = parts

    def require_skill(self) -> None:
        """Begin the task anew.

        Raises:
            RefusedError: no skill carries out its primitive.
        """
        state = self.state
        self.parts.planner.skills[state.task.primitive]  # refused where there is none
        state.under_way = state.refusal = None
        state.next_drive = 1

    def plan(self, attempt: int, like: Plan | None = None) -> None:
        """Plan the current task from where the base stands; the grasps of earlier attempts are left out.

        Raises:
            RefusedError: it cannot be done from here.
        """
        state, parts = self.state, self.parts
        if attempt == 0:
            state.failed_grasps.clear()
        parts.executor.report(Stage.PLANNING, "looking for a grasp and a way")
        state.plan = plan = parts.planner.plan(state.current, parts.base.pose, state.failed_grasps, like)
        data = {"attempt": attempt + 1, **plan.as_data()}
        text = f"planned in {plan.planning_s:.2f} s with the {plan.side} arm"
        parts.executor.report(Stage.PLANNING, text, plan.side, data)

    def plan_from_here(self) -> None:
        """Plan the task as it was seen at first."""
        self.state.current = self.state.task
        self.plan(0)

    def plan_from_nearer(self) -> None:
        """Plan the current task like what was planned for this place of the base before it drove there."""
        approach = self.state.approach
        self.plan(0, None if approach is None else approach.plan)

    def finds_better_grasp_from_nearer(self) -> bool:
        """Find a much better grasp than that of the plan, if this is a doubtful one."""
        state = self.state
        state.approach = self.parts.approach.find_better_grasp(state.task, self._plan_made())
        return state.approach is not None

    def is_best_from_here(self) -> bool:
        """Tell whether no much better grasp was found from nearer."""
        return self.state.approach is None

    def may_work_elsewhere(self) -> bool:
        """Tell whether the failure is one of reach or room, with an empty hand and the arm at home."""
        state, parts = self.state, self.parts
        if not isinstance(state.failure, RECOVERABLE) or parts.executor.in_hand:
            return False
        if parts.is_astray(None if state.under_way is None else state.under_way.plan):
            return False
        state.refusal = state.refusal or state.failure
        return True

    def finds_plan_from_nearer(self) -> bool:
        """Find how far to drive; a distance that was tried is not tried again."""
        state, approach = self.state, self.parts.approach
        state.approach = approach.find_plan(state.task, state.next_drive)
        if state.approach is None:
            return False
        state.next_drive = approach.distances_m.index(state.approach.distance_m) + 1
        return True

    def drive_nearer(self) -> None:
        """Drive as far as was found to help.

        Raises:
            MotionError: the base did not get there.
        """
        distance = 0.0 if self.state.approach is None else self.state.approach.distance_m
        self.parts.executor.report(Stage.APPROACHING, f"driving {distance * 100:.0f} cm nearer")
        self.parts.base.drive_nearer(distance)

    def drive_back(self) -> None:
        """Drive back to where the base began, if it is away."""
        self.parts.base.drive_back()

    def drive_back_from_home(self, _: ExecutionError) -> bool:
        """Drive back after a failure, unless an arm is over the table; the failure stays."""
        state = self.state
        if not self.parts.is_astray(None if state.under_way is None else state.under_way.plan):
            self.parts.base.drive_back()
        return False

    def look_from_nearer(self) -> None:
        """Look where everything is now that the base has driven.

        Raises:
            GraspFailedError: the object is not seen.
        """
        self.state.current = self.parts.observer.look_for(self.state.task)

    def finds_relay(self) -> bool:
        """Find a way by the middle of the table; where there is none the first refusal is the reason."""
        state = self.state
        state.relay = self.parts.approach.find_relay(state.task)
        if state.relay is None:
            state.failure = state.refusal
        return state.relay is not None

    def begin_relay(self) -> None:
        """Take up the first half of the way by the middle."""
        state, relay = self.state, self.state.relay
        if relay is None:
            return
        self.parts.executor.report(Stage.PLANNING, "first I bring it to the middle of the table", relay.plan.side)
        state.current, state.plan, state.approach = relay.first, relay.plan, relay.approach
        state.failed_grasps.clear()

    def look_at_middle(self) -> None:
        """Look where the object is at the middle of the table, to go on from there.

        Raises:
            GraspFailedError: it is not seen.
        """
        state = self.state
        if state.relay is not None:
            state.task = state.current = self.parts.observer.look_for(state.relay.second)

    def needs_drive(self) -> bool:
        """Tell whether the second half begins with a drive."""
        return self.state.approach is not None and self.state.approach.distance_m > 0.0

    def needs_no_drive(self) -> bool:
        """Tell whether the second half can be done from here."""
        return not self.needs_drive()

    # One attempt.

    def sees_object_again(self) -> bool:
        """After a failure that another grasp may mend, look where the object is now."""
        state, failure, plan = self.state, self.state.failure, self._plan_made()
        if not isinstance(failure, GraspFailedError | MisplacedError):
            return False
        if plan.grasp is not None:
            state.failed_grasps.append(plan.grasp.pose)
        found = self.parts.observer.seen_again(state.current, plan)
        if found is None:
            return False
        self.parts.executor.report(Stage.PLANNING, f"{failure}; I try another way", plan.side)
        state.current = found
        return True

    def take(self) -> None:
        """Take the object and bring it over its place.

        Raises:
            GraspFailedError: nothing is in the hand, or it was lost on the way.
            MotionError: the arm was held up.
        """
        state, plan = self.state, self._plan_made()
        state.under_way = PlanUnderWay(plan, state.current)
        self.parts.executor.take(state.current, plan)
        self.parts.executor.carry(plan)

    def recover_from_taking(self, failure: ExecutionError) -> bool:
        """Let the object be and go back; an arm that is home with an empty hand may try another grasp."""
        executor, plan = self.parts.executor, self._plan_made()
        if isinstance(failure, MotionError):
            if executor.recover(plan) and not executor.in_hand:
                self.state.failure = GraspFailedError(str(failure))
        elif executor.stage == Stage.TRANSFERRING:
            executor.recover(plan, "I go back and look where it is")
        else:
            executor.give_up_grasp(plan)
        return False

    def place(self) -> None:
        """Carry out the rest of the plan: set down, let go and go home; nothing of it where the object is kept.

        Raises:
            MotionError: the arm was held up.
        """
        if self._object_end() is not ObjectEnd.IN_HAND:
            self.parts.executor.place(self._plan_made())

    def recover_from_placing(self, _: ExecutionError) -> bool:
        """Go home; where the object was let go before the failure, where it lies is seen afterwards."""
        home = self.parts.executor.recover(self._plan_made())
        return home and not self.parts.executor.in_hand and self._object_end() is ObjectEnd.PLACED

    def check(self) -> None:
        """Look whether the task is done, if it moved something, and say so.

        Raises:
            MisplacedError: the object is not where it was to be.
        """
        state, parts = self.state, self.parts
        skill = parts.planner.skills[state.current.primitive]
        if skill.object_end is ObjectEnd.PLACED:
            state.text = parts.observer.check(state.current, self._plan_made(), skill)
        else:
            held = parts.executor.in_hand if skill.object_end is ObjectEnd.IN_HAND else ""
            state.text = skill.done_text(state.current, held)

    def _object_end(self) -> ObjectEnd:
        return self.parts.planner.skills[self.state.current.primitive].object_end

    def _plan_made(self) -> Plan:
        """Return the plan of the current task.

        Raises:
            PlanningError: none was made.
        """
        if self.state.plan is None:
            raise PlanningError("nothing was planned")
        return self.state.plan
