# SPDX-License-Identifier: Apache-2.0
"""From times within a segment to times of the stream."""

from __future__ import annotations

from dataclasses import replace

from uncom_language.speech.recognition.recognizer import Recognition, Recognizer
from uncom_language.types import Transcript, Word


def shifted(words: tuple[Word, ...], offset_s: float) -> tuple[Word, ...]:
    """Return the words later by an offset [s]."""
    return tuple(replace(word, start_s=word.start_s + offset_s, end_s=word.end_s + offset_s) for word in words)


def shifted_transcript(
    heard: Recognition, offset_s: float, utterance_id: str, recognizer: Recognizer, latency_s: float = 0.0
) -> Transcript:
    """Return a transcript whose times [s] are those of the stream in which the segment began at `offset_s`."""
    return Transcript(
        utterance_id=utterance_id,
        words=shifted(heard.words, offset_s),
        alternatives=tuple(replace(other, words=shifted(other.words, offset_s)) for other in heard.alternatives),
        language=recognizer.language,
        backend=recognizer.backend,
        latency_s=latency_s,
    )
