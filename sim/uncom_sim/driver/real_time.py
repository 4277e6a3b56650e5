# SPDX-License-Identifier: Apache-2.0
"""Periodic tasks in simulated time, and the pace of simulated time against the wall clock."""

from __future__ import annotations

import threading
import time


class PeriodicSchedule:
    """Tells when a periodic task is due in simulated time."""

    def __init__(self, rate_hz: float, start_s: float) -> None:
        """The task is due first at start_s, then at rate_hz; a rate of 0 is never."""
        self._period_s = 1.0 / rate_hz if rate_hz > 0.0 else float("inf")
        self._next_s = start_s

    def set_rate(self, rate_hz: float, now_s: float) -> None:
        """Change the rate; it takes effect at once when the new one is faster."""
        period = 1.0 / rate_hz if rate_hz > 0.0 else float("inf")
        if period != self._period_s:
            self._next_s = min(self._next_s, now_s + period)
            self._period_s = period

    def due(self, now_s: float) -> bool:
        """Return whether the task is due, and schedule it again; periods that were missed are skipped."""
        if now_s < self._next_s - 1e-6:
            return False
        self._next_s += self._period_s
        if self._next_s <= now_s:
            self._next_s = now_s + self._period_s
        return True


class RealTimePacer:
    """Holds simulated time back to a multiple of real time; time that was lost is not made up for."""

    _LATE_S = 0.1  # lost time beyond this is given up
    _SHORTEST_WAIT_S = 0.002  # what is shorter is not waited for

    def __init__(self, factor: float, now_s: float) -> None:
        """Let `factor` simulated seconds pass per second; 0 means as fast as it goes."""
        self._factor = factor
        self._start = (time.monotonic(), now_s)

    def keep(self, now_s: float, stopping: threading.Event) -> None:
        """Wait until simulated time `now_s` is due, or until told to stop."""
        if self._factor <= 0.0:
            return
        wall, sim = self._start
        ahead = (now_s - sim) / self._factor - (time.monotonic() - wall)
        if ahead > self._SHORTEST_WAIT_S:
            stopping.wait(ahead)
        elif ahead < -self._LATE_S:
            self._start = (time.monotonic(), now_s)
