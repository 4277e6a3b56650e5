# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_reasoner. Those below CannotGroundError are said to the person as they are."""

from __future__ import annotations

from uncom_common.exceptions import UncomError


class ReasonerError(UncomError):
    """Base of this package's errors."""


class InvalidWeightsError(ReasonerError, ValueError):
    """A weights file is not usable."""


class InvalidGroundingError(ReasonerError, ValueError):
    """A message or a value does not describe a grounded command."""


class CannotGroundError(ReasonerError):
    """A command cannot be grounded; the text is a sentence for the person."""


class NothingSeenError(CannotGroundError):
    """Nothing that was seen is what was meant."""


class AmbiguousError(CannotGroundError):
    """Several things or places fit about equally; `choices` are their ids."""

    def __init__(self, reason: str, choices: tuple[str, ...] = ()) -> None:
        """Keep the ids that were too close to choose from."""
        self.choices = choices
        super().__init__(reason)


class NoPlaceError(CannotGroundError):
    """No free place satisfies the command."""


class NotSupportedError(CannotGroundError):
    """Understood, but not a thing this robot does."""
