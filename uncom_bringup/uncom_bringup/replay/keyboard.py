# SPDX-License-Identifier: Apache-2.0
"""Single keys from the terminal, while something else goes on."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Any, Self

SPACE, RIGHT, UP, DOWN = " ", "right", "up", "down"
_ARROWS = {b"\x1b[C": RIGHT, b"\x1b[A": UP, b"\x1b[B": DOWN}


class Keyboard:
    """Reads keys without waiting; outside a terminal there are none."""

    def __init__(self) -> None:
        """Look whether there is a terminal."""
        self._descriptor = -1
        self._before: list[Any] = []
        if sys.stdin is not None and not sys.stdin.closed and sys.stdin.isatty():
            self._descriptor = sys.stdin.fileno()

    @property
    def present(self) -> bool:
        """Whether keys can come."""
        return self._descriptor >= 0

    def key(self) -> str | None:
        """Return the key that was pressed last, or None."""
        if not self.present or not select.select([self._descriptor], [], [], 0.0)[0]:
            return None
        data = os.read(self._descriptor, 16)
        return _ARROWS.get(data[-3:]) or data[-1:].decode("ascii", "ignore").lower() or None

    def __enter__(self) -> Self:
        """Take keys one by one, unseen."""
        if self.present:
            self._before = termios.tcgetattr(self._descriptor)
            tty.setcbreak(self._descriptor)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        if self._before:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
