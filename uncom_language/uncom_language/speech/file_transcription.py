# SPDX-License-Identifier: Apache-2.0
"""A whole file to a transcript, and a transcript to JSON."""

from __future__ import annotations

from pathlib import Path
from time import monotonic
from typing import Any

from uncom_language.speech.audio.samples import SAMPLE_RATE
from uncom_language.speech.audio.sound_files import read_sound
from uncom_language.speech.endpointing.endpointer import Endpointer
from uncom_language.speech.recognition.timestamps import transcript_of_segment
from uncom_language.speech.recognizer_factory import make_recognizer
from uncom_language.types import Transcript, Word


def transcribe_file(
    path: str | Path, backend: str = "pocketsphinx", language: str = "en", model: str = ""
) -> Transcript:
    """Recognise a sound or video file; times are seconds from its start, no words if nothing is said.

    Raises:
        SoundFileError: missing, unreadable, empty, or without sound.
        UnknownBackendError: no such back end.
        UnknownLanguageError: the back end does not know the language.
        NotInstalledError, ModelNotFoundError: libraries or weights of Whisper (`model`: folder or name) are missing.
    """
    sound = read_sound(path)
    started = monotonic()
    recognizer = make_recognizer(backend, language, model=model)
    stream = Endpointer()
    segments = [*stream.feed(sound, 0.0), *stream.flush()]
    words: list[Word] = []
    alternatives: Transcript | None = None
    for segment in segments:
        heard = recognizer.transcribe(segment.samples, SAMPLE_RATE)
        made = transcript_of_segment(heard, segment.start_s, "", recognizer)
        words.extend(made.words)
        alternatives = made
    return Transcript(
        utterance_id=Path(path).stem,
        words=tuple(words),
        # Alternatives belong to one utterance; for several they would have to be multiplied out.
        alternatives=alternatives.alternatives if alternatives is not None and len(segments) == 1 else (),
        language=recognizer.language,
        backend=recognizer.backend,
        latency_s=monotonic() - started,
    )


def transcript_to_json(transcript: Transcript) -> dict[str, Any]:
    """Return the layout that `uncom transcribe` prints."""
    return {
        "text": transcript.text,
        "words": [
            {
                "text": word.text,
                "start": round(word.start_s, 3),
                "end": round(word.end_s, 3),
                "confidence": round(word.confidence, 3),
            }
            for word in transcript.words
        ],
        "alternatives": [{"text": other.text, "score": round(other.score, 3)} for other in transcript.alternatives],
        "backend": transcript.backend,
    }
