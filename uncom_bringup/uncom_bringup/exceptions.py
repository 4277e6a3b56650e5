# SPDX-License-Identifier: Apache-2.0
"""Errors of starting the graph, bags and the command line."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from pathlib import Path

from uncom_common.exceptions import UncomError


class ExitStatus(IntEnum):
    """What a command ends with; nodes end with the same numbers."""

    DONE = 0
    FAILED = 1
    BAD_USE = 2
    INTERRUPTED = 130  # 128 and the number of SIGINT, as shells say it


class BringupError(UncomError):
    """Base of this package's errors."""


class BadInputError(BringupError, ValueError):
    """What the user gave cannot be used; the text says what to give instead."""


class BagError(BadInputError):
    """A bag cannot be read."""

    def __init__(self, path: Path, why: str) -> None:
        """`path` is the bag, `why` says what is wrong with it."""
        self.path = path
        super().__init__(f"bag {path}: {why}")


class OutputExistsError(BadInputError):
    """Something is already where the output shall go."""

    def __init__(self, path: Path) -> None:
        """`path` is what exists."""
        self.path = path
        super().__init__(f"{path} exists and is not empty; choose another --out, or give --force to overwrite")


class UnknownTypeError(BringupError, LookupError):
    """A message type is not installed here."""

    def __init__(self, type_name: str) -> None:
        """`type_name` is package/msg/Name."""
        self.type_name = type_name
        super().__init__(f"message type {type_name} is not installed")


class GraphError(BringupError, RuntimeError):
    """A node did not start, or died."""

    exit_status: int = ExitStatus.FAILED

    def __init__(self, node: str, why: str, last_lines: Iterable[str] = ()) -> None:
        """`node` is its name, `why` what became of it, `last_lines` the end of its log."""
        self.node = node
        self.last_lines = tuple(last_lines)
        tail = " | ".join(line.strip() for line in self.last_lines if line.strip())
        super().__init__(f"{node} {why}" + (f"; its last lines: {tail}" if tail else ""))


class NoFreeDomainError(BringupError, RuntimeError):
    """Every ROS domain id that may be used is taken."""
