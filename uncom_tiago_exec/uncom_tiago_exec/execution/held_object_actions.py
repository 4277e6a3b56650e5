# SPDX-License-Identifier: Apache-2.0
"""What the leaves of the tree do with what an earlier command left: an arm over the table, an object in the hand."""

from __future__ import annotations

from dataclasses import replace

from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import ExecutionError, PlanningError, RefusedError, UnreachableError
from uncom_tiago_exec.execution.base_approach import Approach
from uncom_tiago_exec.execution.execution_state import ExecutionState, PlanUnderWay
from uncom_tiago_exec.execution.recovery import plan_in_present_scene
from uncom_tiago_exec.execution.task_actions import ExecutionParts
from uncom_tiago_exec.execution.task_planner import middle_places_in_odom
from uncom_tiago_exec.observation.detection_geometry import footprint_centre
from uncom_tiago_exec.observation.robot_segmentation import robot_boxes, task_with_held_object, without_detections
from uncom_tiago_exec.planning.alternatives import RECOVERABLE
from uncom_tiago_exec.planning.plan import MoveStep, Plan
from uncom_tiago_exec.scene.base_frame import task_in_base
from uncom_tiago_exec.skills.relay_via_middle import to_middle
from uncom_tiago_exec.types import Stage

_WHY_HOME = "first I go back to where I began"


class HeldObjectActions:
    """Actions on the state of one command that begins with what another one left."""

    def __init__(self, state: ExecutionState, parts: ExecutionParts) -> None:
        """Take the state that the actions change, and what they use."""
        self.state = state
        self.parts = parts

    def find_own_parts(self) -> None:
        """Find what was seen of the robot itself, and of what it holds, and leave it out of the task's scene.

        Raises:
            MotionError: there are no joint states.
        """
        state, parts = self.state, self.parts
        held = state.under_way.plan if state.under_way is not None and parts.executor.in_hand else None
        seen = task_in_base(state.task, parts.base.pose)
        boxes = robot_boxes(parts.model, parts.robot.positions(), held)
        state.own_parts = boxes.among((*seen.scene, seen.object))
        state.task = without_detections(state.task, state.own_parts)

    # What was left.

    def fingers_are_at_rest(self) -> bool:
        """Tell whether the fingers were not stopped on their way."""
        return not self.parts.executor.is_gripping

    def is_holding(self) -> bool:
        """Tell whether something is in the hand."""
        return bool(self.parts.executor.in_hand)

    def note_loss(self) -> None:
        """See whether what was in the hand is still there; the arm that has lost it goes home.

        Raises:
            MotionError: there are no joint states.
        """
        state, executor = self.state, self.parts.executor
        if executor.in_hand and (state.under_way is None or executor.holds_nothing(state.under_way.plan)):
            executor.in_hand = ""
            state.unfinished = None if state.under_way is None else state.under_way.plan

    def nothing_was_left(self) -> bool:
        """Tell whether arm and base are where they began."""
        return self.state.unfinished is None and not self.parts.base.is_away

    def no_arm_was_left(self) -> bool:
        """Tell whether both arms are at home."""
        return self.state.unfinished is None

    def goes_home_as_seen_before(self) -> bool:
        """Go home by a way that is free in the scene of the unfinished plan, if there is one."""
        return self.state.unfinished is not None and self.parts.executor.recover(self.state.unfinished, _WHY_HOME)

    def go_home_as_seen_now(self) -> None:
        """Go home by a way that is free in what is seen now.

        Raises:
            RefusedError: there is none either.
        """
        state, executor = self.state, self.parts.executor
        seen = task_in_base(state.task, self.parts.base.pose)
        plan = state.unfinished
        if plan is not None and not executor.recover(
            plan_in_present_scene(plan, seen, holding=bool(executor.in_hand)), _WHY_HOME
        ):
            raise RefusedError("there is no free way back to where I began; make room around my arm")

    def drive_back(self) -> None:
        """Drive back to where the base began, now that the arm is home."""
        self.state.unfinished = None
        self.parts.base.drive_back()

    def look_unobstructed(self) -> None:
        """Look again now that the arm is out of the way."""
        self.state.task = self.parts.observer.look_unobstructed(self.state.task)

    # What is held.

    def begins_holding(self) -> bool:
        """Tell whether something is in the hand now that the task begins, and keep that."""
        self.state.begins_holding = self.is_holding()
        return self.state.begins_holding

    def begins_with_empty_hands(self) -> bool:
        """Tell whether nothing was in the hand when the task began."""
        return not self.state.begins_holding

    def require_held_object(self) -> None:
        """See that the command is to set down what is held.

        Raises:
            RefusedError: it is another one.
        """
        task, held, skills = self.state.task, self.parts.executor.in_hand, self.parts.planner.skills
        words = {*task.object_text.lower().split(), task.object.label.lower()} & {*held.lower().split()}
        places = task.primitive in skills and skills[task.primitive].sets_down_held
        if not places or (task.object_text and not words):
            raise RefusedError(f"I hold the {held}; tell me first where to put it")

    def lift_clear(self) -> None:
        """Lift what is held until it touches nothing, if it can be.

        Raises:
            MotionError: the arm was held up.
        """
        state, executor, (plan, before) = self.state, self.parts.executor, self._under_way()
        executor.report(Stage.PLANNING, f"looking for a place for the {executor.in_hand}", plan.side)
        state.held = plan
        state.task = state.current = task_with_held_object(state.task, before, state.own_parts)
        seen = task_in_base(state.task, self.parts.base.pose)
        executor.lift_clear(plan_in_present_scene(plan, seen, holding=True))

    def plan_placing(self) -> None:
        """Plan to bring what is held to the place of the current task.

        Raises:
            RefusedError: that cannot be done from here.
        """
        state, held = self.state, self._held()
        placing = self.parts.planner.plan_held(state.current, self.parts.base.pose, held)
        first = next(step for step in held.steps if isinstance(step, MoveStep))
        state.plan = replace(placing, steps=(first, *placing.steps))  # home is still where the first motion began
        state.under_way = PlanUnderWay(state.plan, state.current)

    def carry_and_place(self) -> None:
        """Carry out that plan.

        Raises:
            GraspFailedError: it was lost on the way.
            MotionError: the arm was held up.
        """
        plan = self._under_way().plan
        self.parts.executor.carry(plan)
        self.parts.executor.place(plan)

    def recover_from_placing(self, _: ExecutionError) -> bool:
        """Go home; the failure stays."""
        self.parts.executor.recover(self._under_way().plan)
        return False

    def check(self) -> None:
        """Look whether what was held is at its place.

        Raises:
            MisplacedError: it is not.
        """
        plan, task = self._under_way()
        self.state.text = self.parts.observer.check(task, plan, self.parts.planner.skills[task.primitive])

    def may_work_elsewhere(self) -> bool:
        """Tell whether the failure is one of reach or room, and the object still in the hand."""
        return isinstance(self.state.failure, RECOVERABLE) and self.is_holding()

    def finds_drive(self) -> bool:
        """Find how far to drive so that what is held can be set down."""
        state, held = self.state, self._held()
        distance = self.parts.approach.find_drive_for_held(state.current, held)
        state.approach = None if distance is None else Approach(distance, held)
        return distance is not None

    def list_places(self) -> None:
        """List where what is held can be put back: where it was, or at the middle of the table."""
        state = self.state
        middle = middle_places_in_odom(state.task, self.parts.base.pose)
        state.places = [footprint_centre(state.task.object), *middle]

    def takes_next_place(self) -> bool:
        """Take the next of those places as the goal, if there is another."""
        state = self.state
        if not state.places:
            return False
        state.current = to_middle(state.task, state.places.pop(0), Primitive.PLACE)
        return True

    def refuse_to_put_back(self) -> None:
        """Give up.

        Raises:
            UnreachableError: always.
        """
        raise UnreachableError("the arm that holds it does not reach far enough to put it there, nor anywhere else")

    def look_for_put_back(self) -> None:
        """Look where it stands now that it was put back, to begin the task anew.

        Raises:
            GraspFailedError: it is not seen.
        """
        self.state.task = self.parts.observer.look_for(self.state.task, self._under_way().plan)

    def _under_way(self) -> PlanUnderWay:
        if self.state.under_way is None:
            raise PlanningError("nothing was planned")
        return self.state.under_way

    def _held(self) -> Plan:
        if self.state.held is None:
            raise PlanningError("I hold nothing")
        return self.state.held
