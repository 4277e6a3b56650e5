# SPDX-License-Identifier: Apache-2.0
"""Word times within a segment of sound to times of its stream."""

from __future__ import annotations

from dataclasses import replace

from uncom_language.speech.recognition.recognizer import Recognition, Recognizer
from uncom_language.types import Transcript, Word


def shift_words(words: tuple[Word, ...], offset_s: float) -> tuple[Word, ...]:
    """Return the words later by an offset [s]."""
    return tuple(replace(word, start_s=word.start_s + offset_s, end_s=word.end_s + offset_s) for word in words)


def transcript_of_segment(
    recognition: Recognition, offset_s: float, utterance_id: str, recognizer: Recognizer, latency_s: float = 0.0
) -> Transcript:
    """Return a transcript whose times [s] are those of the stream in which the segment began at `offset_s`."""
    return Transcript(
        utterance_id=utterance_id,
        words=shift_words(recognition.words, offset_s),
        alternatives=tuple(
            replace(other, words=shift_words(other.words, offset_s)) for other in recognition.alternatives
        ),
        language=recognizer.language,
        backend=recognizer.backend,
        latency_s=latency_s,
    )
