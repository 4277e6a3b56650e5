# SPDX-License-Identifier: Apache-2.0
"""Carries out a task on a robot: plan, move, grip, check the grip, place, go home, look again.

Runs in a thread of its own and blocks there; it knows the robot only through RobotInterface.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import (
    ExecutionError,
    GraspFailedError,
    InCollisionError,
    MisplacedError,
    MotionError,
    PlanningError,
    RefusedError,
    StoppedError,
    UnreachableError,
)
from uncom_tiago_exec.execution.base_approach import STEPS, FromNearer
from uncom_tiago_exec.execution.base_driver import BaseDriver
from uncom_tiago_exec.execution.plan_executor import Performer, Report
from uncom_tiago_exec.execution.recovery import as_seen_now, is_astray
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.execution.robot_segmentation import own_body, with_held, without
from uncom_tiago_exec.execution.scene_observer import SecondLook
from uncom_tiago_exec.execution.task_planner import TaskPlanner, middle_places_in_odom
from uncom_tiago_exec.execution.verification import middle_of
from uncom_tiago_exec.planning.plan import MoveStep, Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.base_frame import task_in_base
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.relay_via_middle import to_middle
from uncom_tiago_exec.skills.skill import ObjectEnd
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Outcome, Stage

_LOG = logging.getLogger(__name__)
_OTHERWISE = (UnreachableError, InCollisionError, PlanningError)  # what can be done from elsewhere, perhaps


class Engine:
    """One task at a time. Tasks are in odom; plans are in base_footprint, where the base stands for them."""

    def __init__(self, model: RobotModel, robot: RobotInterface, config: ExecutionConfig, report: Report) -> None:
        """Keep the parts; nothing moves yet."""
        self.model = model
        self._planner = TaskPlanner(ManipulationPlanner(model, config), robot)
        self._robot = robot
        self._nearer = FromNearer(self._planner, robot, config)
        self._config = config
        self._hand = Performer(model, robot, config, report)
        self._base = BaseDriver(robot)
        self._eyes = SecondLook(robot, self._hand, config)
        self._under_way: Plan | None = None
        self._before: ManipulationTask | None = None  # what that plan was made for
        self._unfinished: Plan | None = None

    def execute(self, task: ManipulationTask) -> Outcome:
        """Carry out a task; every stage is reported, the last one is DONE, FAILED or STOPPED."""
        self._hand.stage, self._eyes.verification = Stage.IDLE, {}
        try:
            own = self._own_among(task)
            if self._hand.in_hand and not self._hand.is_gripping:
                text = self._place_held(task, own)
            else:
                task = self._finish_what_was_left(without(task, own))
                text = self._place_held(task, own) if self._hand.in_hand else self._run(task)
            self._base.back()
            self._unfinished = None
        except StoppedError as error:
            self._unfinished = self._under_way
            return self._end(Stage.STOPPED, str(error))
        except ExecutionError as error:
            self._unfinished = self._under_way if self._is_astray() else None
            return self._end(Stage.FAILED, str(error))
        return self._end(Stage.DONE, text)

    def _own_among(self, task: ManipulationTask) -> frozenset[str]:
        """Return the ids of what was seen of the robot, and of what it holds."""
        held, seen = self._under_way if self._hand.in_hand else None, task_in_base(task, self._base.pose)
        return own_body(self.model, self._robot.positions(), held).among((*seen.scene, seen.object))

    def _is_astray(self) -> bool:
        """Tell whether an arm was left elsewhere than at home, or may have been: joint states fell silent."""
        try:
            plan = self._under_way
            return plan is not None and is_astray(self.model, plan, self._robot.positions())
        except MotionError:
            return True

    def _finish_what_was_left(self, task: ManipulationTask) -> ManipulationTask:
        """Go home first if the last command was stopped, or failed, on its way; then look where everything is now.

        Raises:
            RefusedError: there is no way home, neither through what was seen before nor through what is seen now.
        """
        plan = self._unfinished
        if plan is None and not self._base.is_away:
            return task
        why, seen = "first I go back to where I began", task_in_base(task, self._base.pose)
        if plan is not None and not (
            self._hand.recover(plan, why)
            or self._hand.recover(as_seen_now(plan, seen, holding=bool(self._hand.in_hand)), why)
        ):
            raise RefusedError("there is no free way back to where I began; make room around my arm")
        self._unfinished = None
        self._base.back()
        return task if self._hand.in_hand else self._eyes.unhidden(task)

    def _place_held(self, task: ManipulationTask, own: frozenset[str]) -> str:
        """Set down what an earlier command has put into the hand, from where the arm and the base were left with it."""
        plan, held = self._under_way, self._hand.in_hand
        if plan is None or self._before is None or self._hand.holds_nothing(plan):
            self._hand.in_hand, self._unfinished = "", plan
            return self._run(self._finish_what_was_left(without(task, own)))
        words = {*task.object_text.lower().split(), task.object.label.lower()} & {*held.lower().split()}
        skills = self._planner.skills
        places = task.primitive in skills and skills[task.primitive].sets_down_held
        if not places or (task.object_text and not words):
            raise RefusedError(f"I hold the {held}; tell me first where to put it")
        self._hand.tell(Stage.PLANNING, f"looking for a place for the {held}", plan.side)
        task = with_held(task, self._before, own)
        self._hand.come_free(as_seen_now(plan, task_in_base(task, self._base.pose), holding=True))
        try:
            return self._set_down_somehow(task, plan)
        except _OTHERWISE:
            if not self._hand.in_hand:
                raise
        return self._put_back(task, plan)

    def _set_down_somehow(self, task: ManipulationTask, plan: Plan) -> str:
        """Bring what a plan has put into the hand to its place, from here or from nearer."""
        try:
            return self._set_down(task, plan)
        except _OTHERWISE:
            nearer = self._nearer.for_held(task, plan) if self._hand.in_hand else None
            if nearer is None:
                raise
        with self._nearer_by(nearer):
            return self._set_down(task, plan)

    def _put_back(self, task: ManipulationTask, plan: Plan) -> str:
        """Set what is held down where the arm that holds it can, as where it was, and bring it to its place from there.

        Raises:
            RefusedError: there is no such place either.
        """
        for place in (middle_of(task.object), *middle_places_in_odom(task, self._base.pose)):
            try:
                self._set_down_somehow(to_middle(task, place), plan)
            except _OTHERWISE:
                if not self._hand.in_hand:
                    raise
                continue
            seen = self._eyes.look_for(task, self._under_way)
            self._base.back()
            return self._run(seen)
        raise UnreachableError("the arm that holds it does not reach far enough to put it there, nor anywhere else")

    def _set_down(self, task: ManipulationTask, plan: Plan) -> str:
        """Bring what a plan has put into the hand to its place."""
        placing = self._planner.plan_held(task, self._base.pose, plan)
        first = next(step for step in plan.steps if isinstance(step, MoveStep))
        placing = replace(placing, steps=(first, *placing.steps))  # home is still where the first motion began
        self._begin(task, placing)
        try:
            self._hand.carry(placing)
            self._hand.place(placing)
        except (GraspFailedError, MotionError):
            self._hand.recover(placing)
            raise
        return self._eyes.check(task, placing, self._planner.skills[task.primitive])

    def _begin(self, task: ManipulationTask, plan: Plan) -> None:
        """Remember what is under way, and what was seen before it."""
        self._under_way, self._before = plan, task

    def _end(self, stage: Stage, text: str) -> Outcome:
        end = stage if stage == Stage.DONE else self._hand.stage
        self._hand.tell(stage, text)
        return Outcome(stage == Stage.DONE, end, text, self._hand.in_hand, self._eyes.verification)

    def _run(self, task: ManipulationTask) -> str:
        self._planner.skills[task.primitive]  # refused where there is none
        self._under_way = None
        try:
            plan = self._plan(task, [], 0)
            surer = self._nearer.surer(task, plan)
            return self._from_nearer(task, *surer) if surer is not None else self._from_here(task, plan)
        except _OTHERWISE as refusal:
            if self._hand.in_hand:
                raise
            first = refusal
        least = 1
        while (ahead := self._nearer.reaching(task, least)) is not None:
            try:
                return self._from_nearer(task, *ahead)
            except _OTHERWISE:  # what was just possible from afar is not, seen from there
                if self._hand.in_hand or self._is_astray():
                    raise
                least = STEPS.index(ahead[0]) + 2
        return self._by_the_middle(task, first)

    def _from_nearer(self, task: ManipulationTask, ahead: float, like: Plan) -> str:
        """Drive towards the table, do it there like the plan made for that, and drive back."""
        with self._nearer_by(ahead):
            near = self._eyes.look_for(task)
            return self._from_here(near, self._plan(near, [], 0, like))

    @contextmanager
    def _nearer_by(self, ahead: float) -> Iterator[None]:
        """Do something from a distance [m] nearer; see BaseDriver."""
        self._hand.tell(Stage.APPROACHING, f"driving {ahead * 100:.0f} cm nearer")
        with self._base.driven(ahead, lambda: not self._is_astray()):
            yield

    def _by_the_middle(self, task: ManipulationTask, refusal: RefusedError) -> str:
        """Set the thing down where the other arm, or the same from another side, can bring it to its place.

        Raises:
            RefusedError: that would not help; nothing has moved.
        """
        found = self._nearer.by_the_middle(task)
        if found is None:
            raise refusal
        half, plan, rest, then = found
        self._hand.tell(Stage.PLANNING, "first I bring it to the middle of the table", plan.side)
        self._from_here(half, plan)
        seen = self._eyes.look_for(rest)
        ahead, like = then
        return self._from_nearer(seen, ahead, like) if ahead > 0.0 else self._from_here(seen)

    def _from_here(self, task: ManipulationTask, ready: Plan | None = None) -> str:
        """Do it, and again another way where that failed and the thing is seen again."""
        failed: list[FloatArray] = []
        for attempt in range(self._config.grasp_attempts):
            plan = ready if ready is not None and attempt == 0 else self._plan(task, failed, attempt)
            self._begin(task, plan)
            try:
                return self._carried_out(task, plan)
            except (GraspFailedError, MisplacedError) as error:
                if plan.grasp is not None:
                    failed.append(plan.grasp.pose)
                if attempt + 1 == self._config.grasp_attempts:
                    raise
                found = self._eyes.seen_again(task, plan)
                if found is None:
                    raise
                self._hand.tell(Stage.PLANNING, f"{error}; I try another way", plan.side)
                task = found
        raise GraspFailedError("no attempt was made")

    def _carried_out(self, task: ManipulationTask, plan: Plan) -> str:
        """Carry out a plan.

        Raises:
            GraspFailedError, MisplacedError: it came to nothing; the arm is back and its hand empty.
        """
        self._take(task, plan)
        skill = self._planner.skills[task.primitive]
        if skill.object_end is ObjectEnd.IN_HAND:
            return skill.done_text(task, self._hand.in_hand)
        untouched = skill.object_end is ObjectEnd.UNTOUCHED
        try:
            self._hand.place(plan)
        except MotionError:
            if not self._hand.recover(plan) or self._hand.in_hand or untouched:
                raise  # else it was let go: where it lies is seen now
        return skill.done_text(task, "") if untouched else self._eyes.check(task, plan, skill)

    def _take(self, task: ManipulationTask, plan: Plan) -> None:
        """Take the thing and bring it over its place, or let it be and go back."""
        try:
            self._hand.take(task, plan)
            self._hand.carry(plan)
        except MotionError as error:
            if self._hand.recover(plan) and not self._hand.in_hand:
                raise GraspFailedError(str(error)) from error
            raise
        except GraspFailedError:
            if self._hand.stage == Stage.TRANSFERRING:
                self._hand.recover(plan, "I go back and look where it is")
            else:
                self._hand.give_up_grasp(plan)
            raise

    def _plan(self, task: ManipulationTask, failed: list[FloatArray], attempt: int, like: Plan | None = None) -> Plan:
        self._hand.tell(Stage.PLANNING, "looking for a grasp and a way")
        plan = self._planner.plan(task, self._base.pose, failed, like)
        data = {"attempt": attempt + 1, **plan.as_data()}
        self._hand.tell(Stage.PLANNING, f"planned in {plan.planning_s:.2f} s with the {plan.side} arm", plan.side, data)
        return plan
