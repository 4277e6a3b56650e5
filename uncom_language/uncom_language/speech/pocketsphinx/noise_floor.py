# SPDX-License-Identifier: Apache-2.0
"""White noise for sound without background, which cepstral mean normalisation needs."""

from __future__ import annotations

import numpy as np

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array
from uncom_language.speech.pocketsphinx.options import NOISE_FLOOR, NoiseFloorOptions


def missing_noise_power(samples: Int16Array, options: NoiseFloorOptions = NOISE_FLOOR) -> float:
    """Return the noise power that sound (N,) lacks for a background options.snr_db below its speech; 0 if none."""
    frame = round(options.frame_s * SAMPLE_RATE)
    usable = samples[: samples.size - samples.size % frame].astype(np.float64).reshape(-1, frame)
    if len(usable) < options.min_frames:
        return 0.0
    power = np.mean(usable**2, axis=1)
    speech = float(np.mean(power[power >= np.percentile(power, options.speech_percentile)]))
    background = float(np.percentile(power, options.background_percentile))
    return max(0.0, speech / float(10.0 ** (options.snr_db / 10.0)) - background)


def add_noise_floor(samples: Int16Array, options: NoiseFloorOptions = NOISE_FLOOR) -> Int16Array:
    """Return sound (N,) with white noise options.snr_db below its speech, unless its own background is louder.

    Cepstral mean normalisation expects the background of a microphone; the perfect silence between synthesised or
    gated words would distort it (measured: without it every second word of clean synthetic speech is lost).
    """
    missing = missing_noise_power(samples, options)
    if missing <= 0.0:
        return samples
    noise = np.random.default_rng(0).standard_normal(samples.size) * np.sqrt(missing)
    return np.asarray(np.clip(np.rint(samples + noise), -32768, 32767), dtype=np.int16)
