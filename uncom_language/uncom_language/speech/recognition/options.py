# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune whether words are believed."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class VerificationOptions:
    """When words are rejected because the sound is no speech, or they do not fit it."""

    frame_s: float = tunable(0.02, unit="s", meaning="length of the frames whose level is measured")
    min_frames: int = tunable(5, meaning="shorter sound is not judged")
    peak_percentile: float = tunable(98, unit="%", meaning="percentile of the levels that counts as the peak")
    background_percentile: float = tunable(5, unit="%", meaning="percentile of the levels that counts as background")
    max_below_peak_db: float = tunable(25.0, unit="dB", meaning="a loud frame is less than this below the peak")
    min_above_background_db: float = tunable(
        5.0, unit="dB", meaning="a loud frame is more than this above the background"
    )
    steady_percentiles: tuple[int, int] = tunable(
        (15, 85), unit="%", meaning="percentiles of the loud levels whose distance is their spread"
    )
    min_spread_db: float = tunable(5.0, unit="dB", meaning="sound with a smaller spread is steady, no speech")
    steady_s: float = tunable(0.5, unit="s", meaning="loud sound from which on its spread is judged")
    max_word_s: float = tunable(
        0.2, unit="s", meaning="longest time that a word covers, to which max_letter_s is added"
    )
    max_letter_s: float = tunable(0.08, unit="s", meaning="time that each letter adds to the longest a word covers")
    min_covered_share: float = tunable(0.5, meaning="least share of the loud time that words must cover")
    min_confidence: float = tunable(0.25, meaning="least mean confidence of the words")


VERIFICATION = VerificationOptions()
