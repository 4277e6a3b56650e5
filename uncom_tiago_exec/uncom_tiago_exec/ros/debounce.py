# SPDX-License-Identifier: Apache-2.0
"""A condition that counts only once it has lasted."""

from __future__ import annotations

import time
from collections.abc import Callable


class Debounce:
    """Tells whether a condition has held at every look for some time.

    Where messages wait to be handled, time may have gone on before the message that says all is well: what looks like
    silence for a moment after the process had no processor is none.
    """

    def __init__(self, least_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Count from `least_s` [s] on, by a clock of wall time."""
        self._least_s = least_s
        self._clock = clock
        self._since_s: float | None = None

    def holds(self, condition: bool) -> bool:
        """Take a look; returns whether the condition has lasted."""
        if not condition:
            self._since_s = None
            return False
        now_s = self._clock()
        if self._since_s is None:
            self._since_s = now_s
        return now_s - self._since_s >= self._least_s
