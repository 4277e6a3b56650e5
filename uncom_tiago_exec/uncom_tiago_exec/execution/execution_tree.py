# SPDX-License-Identifier: Apache-2.0
"""The tree: what execution does, in which order, and what it falls back on. What the leaves do stands elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from py_trees.behaviour import Behaviour

from uncom_tiago_exec.exceptions import ExecutionError, GraspFailedError, MotionError
from uncom_tiago_exec.execution.behaviours import Action, Condition, Recovery, fallback, sequence
from uncom_tiago_exec.execution.held_object_actions import HeldObjectActions
from uncom_tiago_exec.execution.task_actions import TaskActions


class ExecutionTree:
    """Builds the tree of one command."""

    def __init__(self, task: TaskActions, held: HeldObjectActions) -> None:
        """Take what its leaves do."""
        self._task = task
        self._held = held
        self._state = task.state
        self._attempts = task.parts.config.grasp_attempts
        self._drives = len(task.parts.approach.options.distances_m)
        self._places = task.parts.approach.options.put_back_places

    def build(self) -> Behaviour:
        """Return the root: one tick of it carries out the command."""
        held = self._held
        return sequence(
            "execute",
            self._action("tell the robot's own parts", held.find_own_parts),
            self._end_what_was_left(),
            fallback(
                "carry out the task",
                sequence(
                    "with the object in the hand",
                    self._condition("something is in the hand", held.begins_holding),
                    self._set_down_held(),
                ),
                sequence(
                    "with empty hands",
                    self._condition("nothing is in the hand", held.begins_with_empty_hands),
                    self._carry_out(),
                ),
            ),
            self._action("drive back", self._task.drive_back),
        )

    def _action(self, name: str, act: Callable[[], None]) -> Behaviour:
        return Action(name, self._state, act)

    def _condition(self, name: str, holds: Callable[[], bool]) -> Behaviour:
        return Condition(name, self._state, holds)

    # What an earlier command left.

    def _end_what_was_left(self) -> Behaviour:
        held = self._held
        return sequence(
            "end what was left",
            fallback(
                "end the grip",
                self._condition("the fingers are at rest", held.fingers_are_at_rest),
                self._go_home(),
            ),
            self._action("see whether it is still held", held.note_loss),
            fallback("go home", self._condition("something is in the hand", held.is_holding), self._go_home()),
        )

    def _go_home(self) -> Behaviour:
        held = self._held
        return fallback(
            "to where it began",
            self._condition("nothing was left", held.nothing_was_left),
            sequence(
                "bring arm and base home",
                fallback(
                    "bring the arm home",
                    self._condition("both arms are at home", held.no_arm_was_left),
                    self._condition("through the scene seen before", held.goes_home_as_seen_before),
                    self._action("through the scene seen now", held.go_home_as_seen_now),
                ),
                self._action("drive back", held.drive_back),
                fallback(
                    "see everything",
                    self._condition("something is in the hand", held.is_holding),
                    self._action("look again", held.look_unobstructed),
                ),
            ),
        )

    # What is in the hand.

    def _set_down_held(self) -> Behaviour:
        held = self._held
        return sequence(
            "set down what is held",
            self._action("see that it is meant", held.require_held_object),
            self._action("lift it clear", held.lift_clear),
            fallback(
                "here or by way of another place",
                self._set_down_here_or_nearer("set it down"),
                sequence(
                    "put it back and begin anew",
                    self._condition("it may work from elsewhere", held.may_work_elsewhere),
                    self._action("list places", held.list_places),
                    self._put_back(),
                    self._action("look for it", held.look_for_put_back),
                    self._action("drive back", self._task.drive_back),
                    self._carry_out(),
                ),
            ),
        )

    def _put_back(self) -> Behaviour:
        held, places = self._held, []
        for number in range(self._places):
            guard = [self._condition("it may work from elsewhere", held.may_work_elsewhere)] if number else []
            there = self._condition("there is another place", held.takes_next_place)
            places.append(
                sequence(f"place {number + 1}", *guard, there, self._set_down_here_or_nearer("set it back down"))
            )
        refuse = sequence(
            "nowhere",
            self._condition("it may work from elsewhere", held.may_work_elsewhere),
            self._action("refuse", held.refuse_to_put_back),
        )
        return fallback("put it back", *places, refuse)

    def _set_down_here_or_nearer(self, name: str) -> Behaviour:
        held = self._held
        return fallback(
            name,
            self._set_down("from here"),
            sequence(
                "from nearer",
                self._condition("it may work from elsewhere", held.may_work_elsewhere),
                self._condition("a drive helps", held.finds_drive),
                self._there_and_back(self._set_down("set down")),
            ),
        )

    def _set_down(self, name: str) -> Behaviour:
        held = self._held
        return sequence(
            name,
            self._action("plan", held.plan_placing),
            fallback(
                "place",
                self._action("carry and place", held.carry_and_place),
                Recovery("go home", self._state, (GraspFailedError, MotionError), held.recover_from_placing),
            ),
            self._action("look again", held.check),
        )

    # With empty hands.

    def _carry_out(self) -> Behaviour:
        task = self._task
        nearer = [
            sequence(
                "from nearer",
                self._condition("it may work from elsewhere", task.may_work_elsewhere),
                self._condition("a drive helps", task.finds_plan_from_nearer),
                self._from_nearer(),
            )
            for _ in range(self._drives)
        ]
        return sequence(
            "do it",
            self._action("know how", task.require_skill),
            fallback("one way or another", self._from_here(), *nearer, self._by_way_of_the_middle()),
        )

    def _from_here(self) -> Behaviour:
        task = self._task
        return sequence(
            "from here",
            self._action("plan", task.plan_from_here),
            fallback(
                "with the better grasp",
                sequence(
                    "from nearer",
                    self._condition("a much better grasp is there", task.finds_better_grasp_from_nearer),
                    self._from_nearer(),
                ),
                sequence(
                    "as planned",
                    self._condition("no better grasp is there", task.is_best_from_here),
                    self._try_grasps(is_planned=True),
                ),
            ),
        )

    def _from_nearer(self) -> Behaviour:
        task = self._task
        return self._there_and_back(
            self._action("look for it", task.look_from_nearer),
            self._action("plan", task.plan_from_nearer),
            self._try_grasps(is_planned=True),
        )

    def _there_and_back(self, *children: Behaviour) -> Behaviour:
        task = self._task
        return there_and_back(
            self._action("drive nearer", task.drive_nearer),
            children,
            Recovery("drive back from a failure", self._state, (ExecutionError,), task.drive_back_from_home),
            self._action("drive back", task.drive_back),
        )

    def _by_way_of_the_middle(self) -> Behaviour:
        task = self._task
        return sequence(
            "by way of the middle",
            self._condition("it may work from elsewhere", task.may_work_elsewhere),
            self._condition("the middle helps", task.finds_relay),
            self._action("begin there", task.begin_relay),
            self._try_grasps(is_planned=True),
            self._action("look for it", task.look_at_middle),
            fallback(
                "on from the middle",
                sequence("from nearer", self._condition("a drive is needed", task.needs_drive), self._from_nearer()),
                sequence(
                    "from here",
                    self._condition("no drive is needed", task.needs_no_drive),
                    self._try_grasps(is_planned=False),
                ),
            ),
        )

    def _try_grasps(self, *, is_planned: bool) -> Behaviour:
        """Return the attempts, another way each time; is_planned: the first one's plan was made already."""
        task, attempts = self._task, []
        for number in range(self._attempts):
            again = [self._condition("it is seen again", task.sees_object_again)] if number else []
            plan = [] if is_planned and not number else [self._action("plan", partial(task.plan, number))]
            attempts.append(sequence(f"attempt {number + 1}", *again, *plan, *self._take_and_place()))
        return fallback("attempts", *attempts)

    def _take_and_place(self) -> tuple[Behaviour, ...]:
        task, failures = self._task, (GraspFailedError, MotionError)
        return (
            fallback(
                "take",
                self._action("take and carry", task.take),
                Recovery("go back without it", self._state, failures, task.recover_from_taking),
            ),
            fallback(
                "place",
                self._action("place and go home", task.place),
                Recovery("go home", self._state, (MotionError,), task.recover_from_placing),
            ),
            self._action("look again", task.check),
        )


def there_and_back(
    there: Behaviour, children: tuple[Behaviour, ...], recovery: Behaviour, back: Behaviour
) -> Behaviour:
    """Return what drives nearer, does something there and drives back; after a failure the recovery drives back.

    After a stop, or a failure that left an arm elsewhere than at home, the base stays: the next command brings both
    back.
    """
    return sequence("there and back", there, fallback("there", sequence("do it there", *children), recovery), back)
