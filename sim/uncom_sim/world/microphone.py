# SPDX-License-Identifier: Apache-2.0
"""A microphone that is always on: the person's voice when they speak, the room's faint noise before and after."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from uncom_sim.types import SAMPLE_RATE_HZ
from uncom_sim.world.options import MICROPHONE, MicrophoneOptions

Samples = npt.NDArray[np.int16]


class Microphone:
    """Turns simulated time into sound, chunk by chunk."""

    def __init__(self, voice: Samples, start_s: float, seed: int, *, options: MicrophoneOptions = MICROPHONE) -> None:
        """Record from start_s on [s]; the voice (N,), 16-bit at 16 kHz, begins when `speak` is called."""
        self._options = options
        self._voice = voice
        self._speech_start: int | None = None
        self._start_s = start_s
        self._heard = 0
        self._rng = np.random.default_rng([seed, SAMPLE_RATE_HZ])

    def speak(self, time_s: float) -> None:
        """Let the voice begin at a time [s]."""
        self._speech_start = round((time_s - self._start_s) * SAMPLE_RATE_HZ)

    def listen(self, until_s: float, chunk_s: float) -> tuple[float, Samples] | None:
        """Return the next whole chunk and the time of its first sample, or None if it has not been heard by then."""
        count = round(chunk_s * SAMPLE_RATE_HZ)
        if self._heard + count > (until_s - self._start_s) * SAMPLE_RATE_HZ + 1e-6:
            return None
        first, self._heard = self._heard, self._heard + count
        sound = self._rng.normal(0.0, self._options.room_noise, count)
        if self._speech_start is not None:
            begin = max(first, self._speech_start)
            end = min(first + count, self._speech_start + len(self._voice))
            if end > begin:
                sound[begin - first : end - first] += self._voice[begin - self._speech_start : end - self._speech_start]
        return self._start_s + first / SAMPLE_RATE_HZ, np.clip(np.round(sound), -32768, 32767).astype(np.int16)
