# SPDX-License-Identifier: Apache-2.0
"""Alternatives that are tried one after the other, with a record of what was tried, what it cost, and why it failed.

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

BLOCKED: ErrorTypes = (InCollisionError, PlanningError)  # the pose is within reach, but not on this path
RECOVERABLE: ErrorTypes = (UnreachableError, *BLOCKED)  # another pose or another path may succeed


@dataclass(frozen=True, slots=True)
class Attempt:
    """One alternative of a stage that was tried.

    Attributes:
        stage: name of what was searched for.
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
    """All attempts of one planning request, in the order in which they ended."""

    attempts: list[Attempt] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Record(Generic[OptionT]):
    """Where and how the attempts of a stage are recorded.

    Attributes:
        log: that they are appended to.
        stage: name of what is searched for.
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
        error: the last informative failure; before there is one, the error given to the constructor.
    """

    def __init__(
        self,
        options: Iterable[OptionT],
        attempt: Callable[[OptionT], ResultT],
        *,
        error: ExecutionError,
        recoverable: ErrorTypes = RECOVERABLE,
        uninformative: ErrorTypes = (),
        deadline_s: float = float("inf"),
        record: Record[OptionT] | None = None,
    ) -> None:
        """Prepare to try options; nothing is tried yet.

        Args:
            options: in the order in which they are tried; drawn one at a time.
            attempt: tries an option; it returns its result or raises.
            error: what `first` raises if no option leaves an error.
            recoverable: errors after which the next option is tried; others are raised at once.
            uninformative: recoverable errors that say nothing of use to a person: they do not become `error`.
            deadline_s: processor time of this thread [s] after which no further option is tried; not wall time, so
                that a busy machine gets the same search.
            record: where attempts are recorded, if they are.
        """
        self._options = iter(options)
        self._attempt = attempt
        self._recoverable = recoverable
        self._uninformative = uninformative
        self._deadline_s = deadline_s
        self._record = record
        self.failures: list[tuple[OptionT, ExecutionError]] = []
        self.error = error

    def __iter__(self) -> Iterator[ResultT]:
        """Return itself: each option is tried once, even if iteration begins anew."""
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
                self._record_attempt(option, began_s, error)
                self.failures.append((option, error.with_traceback(None)))  # its frames hold scenes and checkers
                if not isinstance(error, self._uninformative):
                    self.error = error
            else:
                self._record_attempt(option, began_s, None)
                return result
        raise StopIteration

    def first(self) -> ResultT:
        """Return the result of the first option that succeeds.

        Raises:
            ExecutionError: none does; it is the last informative failure.
        """
        for result in self:
            return result
        raise self.error

    def _record_attempt(self, option: OptionT, began_s: float, error: ExecutionError | None) -> None:
        """Append an attempt that began at a processor time [s] to the log; error None is a success."""
        record = self._record
        if record is not None:
            failure = "" if error is None else record.reason(error)
            cost_s = time.thread_time() - began_s
            record.log.attempts.append(Attempt(record.stage, record.name(option), cost_s, failure))


def attempts_as_data(attempts: Iterable[Attempt]) -> list[dict[str, object]]:
    """Summarise attempts by stage: their number, cost [s], failures with counts, and the names that succeeded."""
    stages: dict[str, list[Attempt]] = {}
    for attempt in attempts:
        stages.setdefault(attempt.stage, []).append(attempt)
    return [
        {
            "stage": stage,
            "tried": len(tried),
            "cost_s": round(sum(attempt.cost_s for attempt in tried), 4),
            "failures": dict(Counter(attempt.failure for attempt in tried if attempt.failure).most_common()),
            "succeeded": [attempt.name for attempt in tried if not attempt.failure],
        }
        for stage, tried in stages.items()
    ]
