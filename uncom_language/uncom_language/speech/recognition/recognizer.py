# SPDX-License-Identifier: Apache-2.0
"""What every recogniser of speech offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array
from uncom_language.types import Alternative, Word

Samples = npt.NDArray[np.int16] | npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Recognition:
    """What a recogniser made of a stretch of sound; times [s] count from the stretch's first sample.

    No words means that nothing was said; `reason` then tells why the sound was rejected.
    """

    words: tuple[Word, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    reason: str = ""

    @property
    def text(self) -> str:
        """The words as one line."""
        return " ".join(word.text for word in self.words)


class UtteranceDecoder(ABC):
    """One utterance that is recognised while it arrives: mono int16 samples at 16 kHz."""

    @abstractmethod
    def feed(self, samples: Int16Array) -> None:
        """Take the next samples (N,)."""

    @abstractmethod
    def partial_text(self) -> str:
        """Return the words that are likeliest by now, as one line; empty if that is not known yet."""

    @abstractmethod
    def finish(self) -> Recognition:
        """End the utterance and return what it was; times [s] count from its first sample."""


class _BufferingDecoder(UtteranceDecoder):
    """Collects the sound of an utterance for a recogniser that needs it as a whole."""

    def __init__(self, recognizer: Recognizer) -> None:
        self._recognizer = recognizer
        self._chunks: list[Int16Array] = []

    def feed(self, samples: Int16Array) -> None:
        self._chunks.append(samples)

    def partial_text(self) -> str:
        return ""

    def finish(self) -> Recognition:
        if not self._chunks:
            return Recognition(reason="no sound")
        return self._recognizer.transcribe(np.concatenate(self._chunks), SAMPLE_RATE)


class Recognizer(ABC):
    """Turns utterances into words."""

    @property
    @abstractmethod
    def backend(self) -> str:
        """Name and weights, for every result."""

    @property
    @abstractmethod
    def language(self) -> str:
        """Language tag of the words."""

    @abstractmethod
    def transcribe(self, samples: Samples, sample_rate: int) -> Recognition:
        """Recognise mono samples (N,): int16, or float32 within -1..1, at `sample_rate` [Hz].

        Raises:
            SoundFormatError: samples of another type or shape.
        """

    def start_utterance(self) -> UtteranceDecoder:
        """Begin an utterance that arrives piece by piece; one at a time."""
        return _BufferingDecoder(self)

    def add_words(self, words: Mapping[str, str]) -> tuple[str, ...]:  # noqa: ARG002 - this one knows all words
        """Learn further words from now on: word to pronunciation (ARPAbet; empty: by its spelling).

        Returns:
            the words that were new.
        """
        return ()
