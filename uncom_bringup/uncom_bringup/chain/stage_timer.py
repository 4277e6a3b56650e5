# SPDX-License-Identifier: Apache-2.0
"""Processor time by stage."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

ArgumentT = TypeVar("ArgumentT")
ResultT = TypeVar("ResultT")


class StageTimer:
    """Adds up processor time [s] by the name of a stage."""

    def __init__(self) -> None:
        """Start with nothing spent."""
        self.spent_s: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str, *, less: str = "") -> Iterator[None]:
        """Count the time within to a stage, less what is counted to another one meanwhile."""
        begin_s, other_s = time.process_time(), self.spent_s.get(less, 0.0)
        try:
            yield
        finally:
            took_s = time.process_time() - begin_s - (self.spent_s.get(less, 0.0) - other_s)
            self.spent_s[name] = self.spent_s.get(name, 0.0) + took_s

    def timed(self, name: str, function: Callable[[ArgumentT], ResultT], argument: ArgumentT) -> ResultT:
        """Call a function and count its time to a stage."""
        with self.stage(name):
            return function(argument)
