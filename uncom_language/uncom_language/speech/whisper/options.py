# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune Whisper."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class WhisperOptions:
    """How sound is cut for Whisper and what is taken from it."""

    chunk_s: float = tunable(
        30.0, unit="s", meaning="longest sound that is taken as a whole", source="window of Whisper"
    )
    stride_s: float = tunable(5.0, unit="s", meaning="overlap of the chunks of longer sound")
    min_sound_s: float = tunable(0.1, unit="s", meaning="shorter sound holds no word")
    min_level_db: float = tunable(-70.0, unit="dB", meaning="level of full scale below which sound is silence")
    min_word_s: float = tunable(
        0.02, unit="s", meaning="length of a word whose times coincide", source="frame of Whisper"
    )
    hypotheses: int = tunable(5, meaning="beams of the search; all but the best become alternatives")


WHISPER = WhisperOptions()
