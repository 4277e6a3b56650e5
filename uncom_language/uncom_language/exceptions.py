# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_language."""

from __future__ import annotations

from collections.abc import Iterable

from uncom_common.exceptions import UncomError


class LanguageError(UncomError):
    """Base of the errors of hearing and understanding."""


class UnknownBackendError(LanguageError, ValueError):
    """A back end is asked for that does not exist or is not installed."""

    def __init__(self, kind: str, name: str, known: Iterable[str], hint: str = "") -> None:
        """Say which back end of a kind (speech, language) is not available, which are, and how to get it."""
        self.name = name
        choices = ", ".join(known)
        super().__init__(
            f"{kind} back end {name!r} is not available (choose one of: {choices})" + (f"; {hint}" if hint else "")
        )


class UnknownLanguageError(LanguageError, ValueError):
    """No language pack of that name is shipped."""

    def __init__(self, language: str, known: Iterable[str]) -> None:
        """Say for which language there is no pack, and for which there are."""
        self.language = language
        super().__init__(f"no language pack {language!r} (choose one of: {', '.join(known)})")


class LexiconError(LanguageError, ValueError):
    """A lexicon file is not usable."""


class SoundFileError(LanguageError, ValueError):
    """A sound file is missing, unreadable or empty."""

    def __init__(self, path: object, why: str) -> None:
        """Say which file cannot be read, and why."""
        self.path = str(path)
        super().__init__(f"cannot read sound from {self.path}: {why}")


class SoundFormatError(LanguageError, ValueError):
    """Samples or an audio message have a format that cannot be used."""


class RecognizerError(LanguageError, RuntimeError):
    """The recogniser could not be loaded or failed."""


class AnswerError(LanguageError, ValueError):
    """A language model gave no answer that can be used."""


class MicrophoneError(LanguageError, RuntimeError):
    """There is no microphone to listen to."""
