# SPDX-License-Identifier: Apache-2.0
"""Test helper: speech of the simulator's voices between silences, with the true word times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_sim.person.voice import speak

RATE = 16000


@dataclass(frozen=True)
class Spoken:
    """Samples int16 mono 16 kHz and the start [s] of every word."""

    samples: np.ndarray
    starts: tuple[float, ...]


def say(text, voice="en-us", speed=150, pitch=50, lead_s=0.5, tail_s=1.0, snr_db=None, seed=0):
    """Speak a text: silence, words, silence; noise is relative to the speech's own power."""
    spoken = speak(text, voice, speed, pitch)
    wave = np.concatenate([np.zeros(round(RATE * lead_s)), spoken.samples, np.zeros(round(RATE * tail_s))])
    if snr_db is not None:
        power = float(np.mean(spoken.samples**2))
        wave = wave + np.random.default_rng(seed).standard_normal(wave.size) * np.sqrt(power / 10 ** (snr_db / 10))
    samples = np.clip(32768.0 * wave, -32768, 32767).astype(np.int16)
    return Spoken(samples, tuple(lead_s + word.start_s for word in spoken.words))
