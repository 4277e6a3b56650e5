# SPDX-License-Identifier: Apache-2.0
"""Back ends as the nodes' parameters name them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from uncom_language.config import LanguageConfig, SpeechConfig
from uncom_language.language_understanding import Understanding
from uncom_language.parser.end_of_turn import patience_s
from uncom_language.speech.recognition.recognizer import Recognizer
from uncom_language.speech.recognizer_factory import make_recognizer


def recognizer_of(config: SpeechConfig) -> Recognizer:
    """Return the recogniser; see make_recognizer."""
    words = tuple(filter(None, config.scene_words))
    return make_recognizer(config.backend, config.language, words, config.model)


def patience_of(config: SpeechConfig) -> Callable[[str], float]:
    """Return what tells after which pause [s] an utterance of some words is over; see patience_s."""
    quick_s = min(config.quick_pause_s, config.hang_over_s)
    return partial(patience_s, quick_s=quick_s, full_s=config.hang_over_s, language=config.language)


def understanding_of(config: LanguageConfig) -> Understanding:
    """Load the language back end; see Understanding."""
    return Understanding(config.backend, config.language, config.max_alternative_loss, model=config.model)
