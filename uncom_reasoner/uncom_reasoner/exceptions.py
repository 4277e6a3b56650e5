# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_reasoner. Those below CannotGroundError are said to the person as they are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from uncom_common.exceptions import UncomError

if TYPE_CHECKING:
    from uncom_reasoner.types import Candidate


class ReasonerError(UncomError):
    """Base of this package's errors."""


class InvalidWeightsError(ReasonerError, ValueError):
    """A weights file is not usable."""


class InvalidGroundingError(ReasonerError, ValueError):
    """A message or a value does not describe a grounded command."""


class CannotGroundError(ReasonerError):
    """A command cannot be grounded; the text is a sentence for the person."""


class UnsettledError(CannotGroundError):
    """Weighing gave no choice; `candidates` (values of types.Candidate) are what was weighed."""

    def __init__(self, reason: str, candidates: Sequence[Candidate]) -> None:
        """Take the sentence for the person and the candidates that were weighed."""
        self.candidates = tuple(candidates)
        super().__init__(reason)


class NothingSeenError(UnsettledError):
    """None of the objects that were seen is what was meant."""


class AmbiguousError(UnsettledError):
    """Several objects or places fit about equally; `choices` are the ids of those that are too close."""

    def __init__(self, reason: str, candidates: Sequence[Candidate], choices: tuple[str, ...], part: str = "") -> None:
        """Take the sentence, the candidates, the ids of what is too close, and the part ("": the caller knows it)."""
        self.choices = choices
        self.part = part
        super().__init__(reason, candidates)


class NoPlaceError(CannotGroundError):
    """No free place satisfies the command."""


class NotSupportedError(CannotGroundError):
    """The command was understood, but the robot does no such object."""
