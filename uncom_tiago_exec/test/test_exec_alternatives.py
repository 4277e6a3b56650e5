# SPDX-License-Identifier: Apache-2.0
"""Alternatives are tried in order, and what was tried is kept."""

import time
from itertools import islice

import pytest
from uncom_tiago_exec.exceptions import GraspFailedError, InCollisionError, PlanningError, UnreachableError
from uncom_tiago_exec.planning.alternatives import Alternatives, AttemptLog, Record, attempts_as_data


def even(number):
    """Return the half of an even number."""
    if number < 0:
        raise UnreachableError("negative")
    if number % 2:
        raise PlanningError(f"{number} is odd")
    return number // 2


NONE = InCollisionError("nothing was tried")


def test_the_first_that_succeeds_is_taken_and_nothing_after_it_is_tried():
    options = iter([1, 4, 6])
    assert Alternatives(options, even, error=NONE).first() == 2
    assert next(options) == 6


def test_iterating_yields_one_result_after_the_other_and_goes_on_where_it_was_left():
    halves = Alternatives([2, 3, 4, 5, 6, 8], even, error=NONE)
    assert list(islice(halves, 2)) == [1, 2]
    assert list(halves) == [3, 4]


def test_the_last_failure_is_raised_where_none_succeeds():
    with pytest.raises(PlanningError, match="5 is odd"):
        Alternatives([3, 5], even, error=NONE).first()


def test_without_any_option_the_given_error_is_raised():
    with pytest.raises(InCollisionError, match="nothing was tried"):
        Alternatives([], even, error=NONE).first()


def test_an_uninformative_failure_is_a_failure_but_not_the_one_that_is_told():
    halves = Alternatives([3, -1], even, error=NONE, uninformative=(UnreachableError,))
    with pytest.raises(PlanningError, match="3 is odd"):
        halves.first()
    assert [option for option, _ in halves.failures] == [3, -1]


def test_an_error_that_is_not_recoverable_ends_the_search_at_once():
    def lost(_):
        raise GraspFailedError("lost")

    options = iter([1, 2])
    with pytest.raises(GraspFailedError, match="lost"):
        Alternatives(options, lost, error=NONE).first()
    assert next(options) == 2


def test_after_the_deadline_no_further_option_is_tried():
    halves = Alternatives([2, 4], even, error=NONE, deadline_s=time.thread_time() - 1.0)
    assert list(halves) == []
    assert halves.failures == []


def test_every_attempt_is_recorded_with_its_name_cost_and_reason():
    log = AttemptLog()
    record = Record(log, "half", name=lambda n: f"of {n}", reason=lambda error: type(error).__name__)
    assert Alternatives([1, -1, 3, 4], even, error=NONE, record=record).first() == 2
    assert [(a.stage, a.name, a.failure) for a in log.attempts] == [
        ("half", "of 1", "PlanningError"),
        ("half", "of -1", "UnreachableError"),
        ("half", "of 3", "PlanningError"),
        ("half", "of 4", ""),
    ]
    assert all(a.cost_s >= 0.0 for a in log.attempts)
    (told,) = attempts_as_data(log.attempts)
    assert told["tried"] == 4
    assert told["failures"] == {"PlanningError": 2, "UnreachableError": 1}
    assert told["succeeded"] == ["of 4"]
