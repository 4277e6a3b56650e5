# SPDX-License-Identifier: Apache-2.0
"""White noise for sound without background, which cepstral mean normalisation needs."""

from __future__ import annotations

import numpy as np

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array


def missing_floor(samples: Int16Array, snr_db: float = 32.0) -> float:
    """Return the power of the noise that sound (N,) lacks to have a background `snr_db` below its speech; 0 if none."""
    frame = SAMPLE_RATE // 50
    usable = samples[: samples.size - samples.size % frame].astype(np.float64).reshape(-1, frame)
    if usable.shape[0] < 3:
        return 0.0
    power = np.mean(usable**2, axis=1)
    speech = float(np.mean(power[power >= np.percentile(power, 60)]))
    background = float(np.percentile(power, 10))
    return max(0.0, speech / float(10.0 ** (snr_db / 10.0)) - background)


def with_floor(samples: Int16Array, snr_db: float = 32.0) -> Int16Array:
    """Return sound (N,) with white noise `snr_db` below its speech, unless its own background is louder.

    Cepstral mean normalisation expects the background of a microphone; the perfect silence between synthesised or
    gated words would distort it (measured: without it every second word of clean synthetic speech is lost).
    """
    missing = missing_floor(samples, snr_db)
    if missing <= 0.0:
        return samples
    noise = np.random.default_rng(0).standard_normal(samples.size) * np.sqrt(missing)
    return np.asarray(np.clip(np.rint(samples + noise), -32768, 32767), dtype=np.int16)
