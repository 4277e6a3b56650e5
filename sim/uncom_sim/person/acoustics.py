# SPDX-License-Identifier: Apache-2.0
"""The sound that a microphone records of a voice: pauses, reverberation, background noise, 16-bit samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.signal import fftconvolve

from uncom_sim.person.options import ACOUSTICS, AcousticsOptions
from uncom_sim.person.voice import Utterance
from uncom_sim.types import SAMPLE_RATE_HZ


def insert_pause(utterance: Utterance, after_word: int, pause_s: float) -> Utterance:
    """Return the utterance with a pause [s] after the word of a number."""
    if pause_s <= 0.0 or after_word + 1 >= len(utterance.words):
        return utterance
    cut_s = (utterance.words[after_word].end_s + utterance.words[after_word + 1].start_s) / 2.0
    cut = int(cut_s * SAMPLE_RATE_HZ)
    gap = np.zeros(int(pause_s * SAMPLE_RATE_HZ))
    later = [
        replace(w, start_s=w.start_s + pause_s, end_s=w.end_s + pause_s) for w in utterance.words[after_word + 1 :]
    ]
    samples = np.concatenate([utterance.samples[:cut], gap, utterance.samples[cut:]])
    return Utterance(samples, (*utterance.words[: after_word + 1], *later))


def record(
    utterance: Utterance,
    start_s: float,
    duration_s: float,
    noise: float,
    reverb: float,
    rng: np.random.Generator,
    *,
    options: AcousticsOptions = ACOUSTICS,
) -> npt.NDArray[np.int16]:
    """Return what a microphone records over duration_s when the utterance begins at start_s, mono 16 kHz.

    noise is the level of the background relative to speech, reverb the level of the echo relative to the direct sound.
    """
    clean = np.zeros(int(duration_s * SAMPLE_RATE_HZ))
    first = int(start_s * SAMPLE_RATE_HZ)
    speech = utterance.samples[: max(0, len(clean) - first)]
    clean[first : first + len(speech)] = speech
    if reverb > 0.0 and len(speech):
        t = np.arange(int(options.reverberation_time_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ
        tail = rng.normal(0.0, 1.0, len(t)) * np.exp(-6.9 * t / options.reverberation_time_s)
        clean = clean + reverb * fftconvolve(clean, tail / np.linalg.norm(tail))[: len(clean)]
    peak = float(np.abs(clean).max()) if len(clean) else 0.0
    clean *= options.peak / peak if peak > 0.0 else 1.0
    loud = clean[np.abs(clean) > options.speech_level]
    level = float(np.sqrt(np.mean(loud**2))) if len(loud) else 0.1
    heard = clean + _pink_noise(len(clean), rng) * (noise * level + options.noise_floor)
    return np.asarray(np.clip(np.round(heard * 32767.0), -32768, 32767).astype(np.int16))


def _pink_noise(count: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """Noise of unit power that falls with frequency, as rooms and fans make it."""
    spectrum = np.fft.rfft(rng.normal(0.0, 1.0, count))
    frequency = np.fft.rfftfreq(count, 1.0 / SAMPLE_RATE_HZ)
    shaped = np.fft.irfft(spectrum / np.sqrt(np.maximum(frequency, 60.0)), count)
    return np.asarray(shaped / max(float(np.std(shaped)), 1e-12))
