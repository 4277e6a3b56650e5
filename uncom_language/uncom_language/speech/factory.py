# SPDX-License-Identifier: Apache-2.0
"""Recognisers by name."""

from __future__ import annotations

from functools import cache

from uncom_language.exceptions import UnknownBackendError, UnknownLanguageError
from uncom_language.speech.pocketsphinx_recognizer import PocketSphinxRecognizer
from uncom_language.speech.recognizer import Recognizer

BACKENDS = ("pocketsphinx",)
LANGUAGES = ("en",)


def check_backend(backend: str, language: str = "en") -> None:
    """Complain at once about a recogniser that could not be made.

    Raises:
        UnknownBackendError: no such back end, or it is not installed.
        UnknownLanguageError: the back end has no model of that language.
    """
    if backend not in BACKENDS:
        hint = "the full models are not installed" if backend == "whisper" else ""
        raise UnknownBackendError("speech", backend, BACKENDS, hint)
    if language not in LANGUAGES:
        raise UnknownLanguageError(language, LANGUAGES)


@cache
def make_recognizer(
    backend: str = "pocketsphinx", language: str = "en", scene_words: tuple[str, ...] = ()
) -> Recognizer:
    """Return the (shared) recogniser of a name; the same errors as check_backend."""
    check_backend(backend, language)
    return PocketSphinxRecognizer(scene_words=scene_words)
