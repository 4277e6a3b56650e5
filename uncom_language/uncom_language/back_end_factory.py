# SPDX-License-Identifier: Apache-2.0
"""Back ends as the nodes' parameters name them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from uncom_language.config import LanguageConfig, SpeechConfig
from uncom_language.language_understanding import LanguageUnderstanding
from uncom_language.parser.end_of_turn import end_of_turn_pause_s
from uncom_language.speech.recognition.recognizer import Recognizer
from uncom_language.speech.recognizer_factory import make_recognizer


def recognizer_from_config(config: SpeechConfig) -> Recognizer:
    """Return the recogniser; see make_recognizer."""
    words = tuple(filter(None, config.scene_words))
    return make_recognizer(config.backend, config.language, words, config.model)


def end_of_turn_pause_from_config(config: SpeechConfig) -> Callable[[str], float]:
    """Return end_of_turn_pause_s of a configuration: a function from the words so far to a pause [s]."""
    complete_pause_s = min(config.quick_pause_s, config.hang_over_s)
    return partial(
        end_of_turn_pause_s,
        complete_pause_s=complete_pause_s,
        incomplete_pause_s=config.hang_over_s,
        language=config.language,
    )


def understanding_from_config(config: LanguageConfig) -> LanguageUnderstanding:
    """Load the language back end; see LanguageUnderstanding."""
    return LanguageUnderstanding(config.backend, config.language, config.max_alternative_loss, model=config.model)
