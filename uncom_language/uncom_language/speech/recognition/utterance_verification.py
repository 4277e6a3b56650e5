# SPDX-License-Identifier: Apache-2.0
"""Whether sound that a recogniser put words to was speech at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array
from uncom_language.types import Word

_FRAME = SAMPLE_RATE // 50
_MARGIN_DB = 10.0
_STEADY_DB = 5.0
_STEADY_S = 0.5
_LEAST_COVER = 0.5
_WORD_S, _LETTER_S = 0.2, 0.08
_LEAST_CONFIDENCE = 0.25


def why_not_speech(sound: Int16Array, words: Sequence[Word]) -> str:
    """Return why words (times [s] from the first sample) are not to be believed; empty if they are.

    Speech rises and falls by 10 to 30 dB within a word or two, and its words fill the time that is loud.
    """
    usable = sound[: sound.size - sound.size % _FRAME].astype(np.float64).reshape(-1, _FRAME)
    if len(usable) < 5:
        return ""
    level = 10.0 * np.log10(np.mean(usable**2, axis=1) + 1.0)
    peak = float(np.percentile(level, 98))
    loud = level > max(peak - 25.0, float(np.percentile(level, 5)) + _MARGIN_DB / 2.0)
    loud_s = float(np.count_nonzero(loud)) * _FRAME / SAMPLE_RATE
    if loud_s >= _STEADY_S and float(np.ptp(np.percentile(level[loud], [15, 85]))) < _STEADY_DB:
        return "a steady sound, no speech"
    covered = np.zeros(len(level), dtype=bool)
    for word in words:
        # A word that lasts longer than anybody draws it out is something else.
        end_s = min(word.end_s, word.start_s + _WORD_S + _LETTER_S * len(word.text))
        covered[int(word.start_s * SAMPLE_RATE / _FRAME) : int(end_s * SAMPLE_RATE / _FRAME) + 1] = True
    if loud_s > 0.0 and np.count_nonzero(covered & loud) * _FRAME / SAMPLE_RATE < _LEAST_COVER * loud_s:
        return "hardly any of the sound was words"
    if float(np.mean([word.confidence for word in words])) < _LEAST_CONFIDENCE:
        return "no words that could be told from others"
    return ""
