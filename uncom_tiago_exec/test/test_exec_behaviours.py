# SPDX-License-Identifier: Apache-2.0
"""A failure ends at its behaviour and becomes a value of the state; a stop lets nothing begin any more."""

import numpy as np
import pytest
from py_trees.common import Status
from uncom_common.primitive import Primitive
from uncom_perception.types import Box, Detection
from uncom_tiago_exec.exceptions import GraspFailedError, MotionError, StoppedError, UnreachableError
from uncom_tiago_exec.execution.behaviours import Action, Condition, Recovery, fallback, sequence, tree_as_data
from uncom_tiago_exec.execution.execution_state import ExecutionState
from uncom_tiago_exec.types import ManipulationTask


@pytest.fixture
def state():
    cup = Detection("d0", "cup", 1.0, Box(0, 0, 1, 1), np.ones((1, 1), dtype=bool))
    task = ManipulationTask("u1", 0, Primitive.PICK, "none", cup, (cup,), None)
    return ExecutionState(task, task)


def fails_with(error):
    def fail():
        raise error

    return fail


def nothing():
    pass


def ticked(root):
    root.tick_once()
    return root.status


def test_what_an_action_fails_with_is_a_value_of_the_state(state):
    error = UnreachableError("no arm reaches that")
    action = Action("take", state, fails_with(error))
    assert ticked(action) is Status.FAILURE
    assert state.failure is error
    assert tree_as_data(action) == {
        "name": "take",
        "kind": "Action",
        "status": "FAILURE",
        "reason": "no arm reaches that",
    }


def test_other_faults_than_those_of_execution_are_not_hidden(state):
    with pytest.raises(ZeroDivisionError):
        ticked(Action("take", state, lambda: 1 / 0))


def test_a_fallback_takes_the_first_alternative_that_succeeds_and_keeps_why_the_others_failed(state):
    done = []
    root = fallback(
        "any",
        Action("here", state, fails_with(UnreachableError("too far"))),
        Action("nearer", state, lambda: done.append("nearer")),
        Action("by the middle", state, lambda: done.append("middle")),
    )
    assert ticked(root) is Status.SUCCESS
    assert done == ["nearer"]
    assert state.failure is None
    children = tree_as_data(root)["children"]
    assert [(child["name"], child["status"]) for child in children] == [("here", "FAILURE"), ("nearer", "SUCCESS")]
    assert children[0]["reason"] == "too far"


def test_a_condition_that_does_not_hold_leaves_the_failure_before_it_as_the_reason(state):
    error = UnreachableError("too far")
    root = fallback(
        "any",
        Action("here", state, fails_with(error)),
        sequence("nearer", Condition("a drive helps", state, lambda: False), Action("drive", state, nothing)),
    )
    assert ticked(root) is Status.FAILURE
    assert state.failure is error


def test_after_a_stop_nothing_begins_neither_a_fallback_nor_a_recovery(state):
    begun = []
    root = fallback(
        "any",
        fallback(
            "take",
            Action("take", state, fails_with(StoppedError("stopped on request"))),
            Recovery("go back", state, (MotionError, StoppedError), lambda _: begun.append("recovery") or True),
        ),
        Condition("a drive helps", state, lambda: begun.append("condition") or True),
        Action("from nearer", state, lambda: begun.append("action")),
    )
    assert ticked(root) is Status.FAILURE
    assert state.is_stopped
    assert not begun
    assert tree_as_data(root)["children"][1]["reason"] == "not begun: stopped"


@pytest.mark.parametrize("makes_good", [True, False])
def test_a_recovery_follows_a_failure_of_its_kind_and_may_make_good_for_it(state, makes_good):
    error, recovered = MotionError("the arm was held up"), []
    root = fallback(
        "place",
        Action("place", state, fails_with(error)),
        Recovery("go home", state, (MotionError,), lambda failure: recovered.append(failure) or makes_good),
    )
    assert ticked(root) is (Status.SUCCESS if makes_good else Status.FAILURE)
    assert recovered == [error]
    assert state.failure is (None if makes_good else error)


def test_a_recovery_of_another_kind_is_not_needed(state):
    root = fallback(
        "place",
        Action("place", state, fails_with(GraspFailedError("it slipped"))),
        Recovery("go home", state, (MotionError,), lambda _: True),
    )
    assert ticked(root) is Status.FAILURE
    assert isinstance(state.failure, GraspFailedError)
    assert tree_as_data(root)["children"][1]["reason"] == "not needed"


def test_a_recovery_that_fails_is_the_reason(state):
    root = fallback(
        "place",
        Action("place", state, fails_with(GraspFailedError("it slipped"))),
        Recovery("go home", state, (GraspFailedError,), lambda _: fails_with(MotionError("joints fell silent"))()),
    )
    assert ticked(root) is Status.FAILURE
    assert str(state.failure) == "joints fell silent"
