# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_sim."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from uncom_common.exceptions import UncomError


class SimError(UncomError):
    """The simulated world or robot cannot be made or driven as asked."""


class SceneError(SimError, ValueError):
    """A scene or scenario cannot be used as it is written."""


class UnknownKindError(SceneError):
    """There is no such kind of object."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        """Name is the unknown kind, known are the kinds that the text lists."""
        self.name = name
        super().__init__(f"unknown kind {name!r}; kinds are: {', '.join(known)}")


class UnknownColourError(SceneError):
    """There is no such colour."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        """Name is the unknown colour, known are the colours that the text lists."""
        self.name = name
        super().__init__(f"unknown colour {name!r}; colours are: {', '.join(known)}")


class WorkerError(SimError):
    """A process that works for us cannot be started or reached, or gave no answer that can be used."""


class WorkerDiedError(WorkerError):
    """So many worker processes died at one task that it is not tried again."""

    def __init__(self, task: str, deaths: int, log: Path | None) -> None:
        """Task is the name of the task, deaths how many processes died, log the file that they wrote to, if any."""
        self.task = task
        super().__init__(f"{task}: {deaths} processes died at it" + ("" if log is None else f" (see {log})"))


class VoiceError(SimError):
    """The simulated person's voice cannot be made."""
