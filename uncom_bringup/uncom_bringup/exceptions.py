# SPDX-License-Identifier: Apache-2.0
"""Errors of starting the graph, bags and the command line."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from uncom_common.exceptions import UncomError


class BringupError(UncomError):
    """Base of this package's errors."""


class BadInputError(BringupError, ValueError):
    """What the user gave cannot be used; the text says what to give instead."""


class BagError(BadInputError):
    """A bag cannot be read."""

    def __init__(self, path: Path, why: str) -> None:
        """Keep the path."""
        self.path = path
        super().__init__(f"bag {path}: {why}")


class OutputExistsError(BadInputError):
    """Something is already where the output shall go."""

    def __init__(self, path: Path) -> None:
        """Keep the path."""
        self.path = path
        super().__init__(f"{path} exists and is not empty; choose another --out, or give --force to overwrite")


class UnknownTypeError(BringupError, LookupError):
    """A message type is not installed here."""

    def __init__(self, type_name: str) -> None:
        """Keep the name."""
        self.type_name = type_name
        super().__init__(f"message type {type_name} is not installed")


class GraphError(BringupError, RuntimeError):
    """A node did not start, or died."""

    exit_status = 1

    def __init__(self, node: str, why: str, last_lines: Iterable[str] = ()) -> None:
        """Keep the node and the last lines it wrote."""
        self.node = node
        self.last_lines = tuple(last_lines)
        tail = " | ".join(line.strip() for line in self.last_lines if line.strip())
        super().__init__(f"{node} {why}" + (f"; its last lines: {tail}" if tail else ""))


class NoFreeDomainError(BringupError, RuntimeError):
    """Every ROS domain id that may be used is taken."""
