# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_perception."""

from __future__ import annotations

from collections.abc import Iterable

from uncom_common.exceptions import UncomError


class PerceptionError(UncomError):
    """Base of the errors of this package."""


class UnknownBackendError(PerceptionError, ValueError):
    """A back end was asked for by a name that none has."""

    def __init__(self, family: str, name: str, known: Iterable[str]) -> None:
        """Keep the name; list the known ones."""
        self.family = family
        self.name = name
        super().__init__(f"{family} back end {name!r} is not known; choose one of: {', '.join(sorted(known))}")


class BackendUnavailableError(PerceptionError, RuntimeError):
    """A back end cannot work on this machine or with this configuration."""


class InvalidImageError(PerceptionError, ValueError):
    """An image, a depth image or a mask has a shape or a type that cannot be used."""


class InvalidLexiconError(PerceptionError, ValueError):
    """A lexicon file cannot be read."""


class TableNotFoundError(PerceptionError, LookupError):
    """No table top is visible."""
