# SPDX-License-Identifier: Apache-2.0
"""What every recogniser of speech offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

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


class Recognizer(ABC):
    """Turns one utterance into words."""

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
