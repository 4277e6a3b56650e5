# SPDX-License-Identifier: Apache-2.0
"""Whether sound that a recogniser put words to was speech at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array
from uncom_language.speech.recognition.options import VERIFICATION, VerificationOptions
from uncom_language.types import Word


def rejection_reason(sound: Int16Array, words: Sequence[Word], options: VerificationOptions = VERIFICATION) -> str:
    """Return why words (times [s] from the first sample) are not to be believed; empty if they are.

    Speech rises and falls by 10 to 30 dB within a word or two, and its words fill the time that is loud.
    """
    frame = round(options.frame_s * SAMPLE_RATE)
    usable = sound[: sound.size - sound.size % frame].astype(np.float64).reshape(-1, frame)
    if len(usable) < options.min_frames:
        return ""
    level = 10.0 * np.log10(np.mean(usable**2, axis=1) + 1.0)
    peak = float(np.percentile(level, options.peak_percentile))
    background = float(np.percentile(level, options.background_percentile))
    loud = level > max(peak - options.max_below_peak_db, background + options.min_above_background_db)
    loud_s = float(np.count_nonzero(loud)) * frame / SAMPLE_RATE
    spread_db = float(np.ptp(np.percentile(level[loud], options.steady_percentiles))) if loud_s > 0.0 else 0.0
    if loud_s >= options.steady_s and spread_db < options.min_spread_db:
        return "a steady sound, no speech"
    covered = np.zeros(len(level), dtype=bool)
    for word in words:
        # A word that lasts longer than anybody draws it out is something else.
        end_s = min(word.end_s, word.start_s + options.max_word_s + options.max_letter_s * len(word.text))
        covered[int(word.start_s * SAMPLE_RATE / frame) : int(end_s * SAMPLE_RATE / frame) + 1] = True
    if loud_s > 0.0 and np.count_nonzero(covered & loud) * frame / SAMPLE_RATE < options.min_covered_share * loud_s:
        return "hardly any of the sound was words"
    if float(np.mean([word.confidence for word in words])) < options.min_confidence:
        return "no words that could be told from others"
    return ""
