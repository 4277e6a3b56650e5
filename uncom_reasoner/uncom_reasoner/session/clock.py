# SPDX-License-Identifier: Apache-2.0
"""The two clocks of a session."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Time as it is passed in; a test or a recording has its own."""

    def stamp_s(self) -> float:
        """Return the time on the clock of the sensors' stamps [s]; it may stand still or jump."""

    def steady_s(self) -> float:
        """Return a time that only goes on [s]: for the time-outs of questions and of whoever does not answer."""
