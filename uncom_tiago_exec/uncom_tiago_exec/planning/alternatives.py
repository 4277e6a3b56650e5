# SPDX-License-Identifier: Apache-2.0
"""Alternatives that are tried one after the other, as data: what was tried, what it cost, and why it failed.

The containers of MoveIt Task Constructor (Goerner et al. 2019) in one class: its Fallbacks is `first`, which takes the
first alternative that succeeds; its Alternatives is iterating, which yields one result after the other until enough
have been found to choose from.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError, UnreachableError

OptionT = TypeVar("OptionT")
ResultT = TypeVar("ResultT")
ErrorTypes = tuple[type[ExecutionError], ...]

BLOCKED: ErrorTypes = (InCollisionError, PlanningError)  # the pose can be reached, but not so
NOT_SO: ErrorTypes = (UnreachableError, *BLOCKED)  # another pose or another path may do


@dataclass(frozen=True, slots=True)
class Attempt:
    """One alternative of a stage that was tried.

    Attributes:
        stage: what was looked for.
        name: of the alternative.
        cost_s: processor time that it took [s].
        failure: why it failed; empty if it succeeded.
    """

    stage: str
    name: str
    cost_s: float
    failure: str = ""


@dataclass(slots=True)
class AttemptLog:
    """All attempts of one planning, in the order of their ends."""

    attempts: list[Attempt] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Record(Generic[OptionT]):
    """Where and how the attempts of a stage are recorded.

    Attributes:
        log: that they are appended to.
        stage: what is looked for.
        name: returns the name of an alternative.
        reason: returns the reason of a failure.
    """

    log: AttemptLog
    stage: str
    name: Callable[[OptionT], str] = str
    reason: Callable[[ExecutionError], str] = str


class Alternatives(Generic[OptionT, ResultT]):
    """Options of one stage; iterating tries them lazily, in order, and yields the results of those that succeed.

    Attributes:
        failures: options that failed, each with its error.
        error: the last failure that tells something, or what was given as error.
    """

    def __init__(
        self,
        options: Iterable[OptionT],
        attempt: Callable[[OptionT], ResultT],
        *,
        error: ExecutionError,
        recoverable: ErrorTypes = NOT_SO,
        passed_over: ErrorTypes = (),
        deadline_s: float = float("inf"),
        record: Record[OptionT] | None = None,
    ) -> None:
        """Take the options and what tries one of them; nothing is tried yet.

        Args:
            options: in the order in which they are tried; drawn one at a time.
            attempt: tries an option; it returns its result or raises.
            error: what `first` raises if no option leaves an error.
            recoverable: errors after which the next option is tried; others are raised at once.
            passed_over: recoverable errors that tell nothing: they do not become `error`.
            deadline_s: processor time of this thread after which no further option is tried [s]; a busy machine gets
                the same search.
            record: where attempts are recorded, if they are.
        """
        self._options = iter(options)
        self._attempt = attempt
        self._recoverable = recoverable
        self._passed_over = passed_over
        self._deadline_s = deadline_s
        self._record = record
        self.failures: list[tuple[OptionT, ExecutionError]] = []
        self.error = error

    def __iter__(self) -> Iterator[ResultT]:
        """Return itself: each option is tried once, however often iteration is begun."""
        return self

    def __next__(self) -> ResultT:
        """Try options until one succeeds, and return its result."""
        for option in self._options:
            began_s = time.thread_time()
            if began_s > self._deadline_s:
                break
            try:
                result = self._attempt(option)
            except self._recoverable as error:
                self._note(option, began_s, error)
                self.failures.append((option, error.with_traceback(None)))  # its frames hold scenes and checkers
                if not isinstance(error, self._passed_over):
                    self.error = error
            else:
                self._note(option, began_s, None)
                return result
        raise StopIteration

    def first(self) -> ResultT:
        """Return the result of the first option that succeeds.

        Raises:
            ExecutionError: none does; it is the last failure that tells something.
        """
        for result in self:
            return result
        raise self.error

    def _note(self, option: OptionT, began_s: float, error: ExecutionError | None) -> None:
        record = self._record
        if record is not None:
            failure = "" if error is None else record.reason(error)
            cost_s = time.thread_time() - began_s
            record.log.attempts.append(Attempt(record.stage, record.name(option), cost_s, failure))


def attempts_as_data(attempts: Iterable[Attempt]) -> list[dict[str, object]]:
    """Sum up attempts stage by stage: how many, their cost [s], reasons of failure with counts, what succeeded."""
    stages: dict[str, list[Attempt]] = {}
    for attempt in attempts:
        stages.setdefault(attempt.stage, []).append(attempt)
    return [
        {
            "stage": stage,
            "tried": len(tried),
            "cost_s": round(sum(one.cost_s for one in tried), 4),
            "failures": dict(Counter(one.failure for one in tried if one.failure).most_common()),
            "succeeded": [one.name for one in tried if not one.failure],
        }
        for stage, tried in stages.items()
    ]
