# SPDX-License-Identifier: Apache-2.0
"""Recognisers by name."""

from __future__ import annotations

from functools import cache

from uncom_common.pretrained_models import require

from uncom_language.exceptions import UnknownBackendError, UnknownLanguageError
from uncom_language.speech.pocketsphinx.pocketsphinx_recognizer import PocketSphinxRecognizer
from uncom_language.speech.recognition.recognizer import Recognizer
from uncom_language.speech.whisper.whisper_recognizer import DEFAULT_MODEL, WhisperRecognizer

BACKENDS = ("pocketsphinx", "whisper")
# The default recogniser's acoustic models are English; Whisper knows some hundred languages by their tags.
LANGUAGES = ("en",)


def check_backend(backend: str, language: str = "en") -> None:
    """Complain at once about a recogniser that could not be made.

    Raises:
        UnknownBackendError: no such back end.
        UnknownLanguageError: the back end has no model of that language.
        NotInstalledError: the back end's libraries are missing.
    """
    if backend not in BACKENDS:
        raise UnknownBackendError("speech", backend, BACKENDS)
    if backend == "whisper":
        require("torch")
        require("transformers")
    elif language not in LANGUAGES:
        raise UnknownLanguageError(language, LANGUAGES)


@cache
def make_recognizer(
    backend: str = "pocketsphinx", language: str = "en", scene_words: tuple[str, ...] = (), model: str = ""
) -> Recognizer:
    """Return the (shared) recogniser of a name; `model` is Whisper's folder or hub name.

    Raises:
        ModelNotFoundError: the weights are missing; beside the errors of check_backend.
    """
    check_backend(backend, language)
    if backend == "whisper":
        return WhisperRecognizer(model or DEFAULT_MODEL, language)
    return PocketSphinxRecognizer(scene_words=scene_words)
