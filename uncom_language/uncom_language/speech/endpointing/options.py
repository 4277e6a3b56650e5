# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune where utterances begin and end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from uncom_common.exceptions import InvalidConfigError
from uncom_common.tunables import tunable

FRAME_S = 0.03  # length of the frames that the voice activity detector judges [s]; WebRTC's takes 10, 20 or 30 ms
VAD_MODES = (0, 1, 2, 3)  # of WebRTC's voice activity detector
# Usable values, lowest and highest [s].
ENDPOINTER_RANGES: Mapping[str, tuple[float, float]] = {
    "pre_roll_s": (0.0, 2.0),
    "hang_over_s": (0.1, 3.0),
    "max_length_s": (2.0, math.inf),
}


@dataclass(frozen=True, slots=True)
class EndpointerOptions:
    """When an utterance begins and ends."""

    pre_roll_s: float = tunable(0.3, unit="s", meaning="sound kept before the first voiced frame")
    hang_over_s: float = tunable(0.8, unit="s", meaning="silence that ends an utterance")
    min_voiced_s: float = tunable(0.15, unit="s", meaning="voiced time within onset_window_s that begins an utterance")
    onset_window_s: float = tunable(0.3, unit="s", meaning="window in which min_voiced_s is counted")
    max_length_s: float = tunable(20.0, unit="s", meaning="longer utterances are cut")
    noise_window_s: float = tunable(4.0, unit="s", meaning="window over which the level of the background is taken")
    noise_divisor: int = tunable(
        10, meaning="the background is the level of the quietest of so many parts of the window"
    )
    margin_db: float = tunable(7.0, unit="dB", meaning="how far speech is above the background")
    floor_db: float = tunable(-58.0, unit="dB", meaning="level of full scale below which a frame never counts")
    vad_mode: int = tunable(1, meaning="mode of WebRTC's detector: 0 takes most for speech, 3 least")
    max_stamp_gap_s: float = tunable(0.2, unit="s", meaning="a larger jump of the stamps ends the open utterance")
    max_clock_drift_s: float = tunable(0.02, unit="s", meaning="a larger one moves the time of the stream")

    def __post_init__(self) -> None:
        """Refuse values that make no sense.

        Raises:
            InvalidConfigError: a value outside its range.
        """
        for name, (low, high) in ENDPOINTER_RANGES.items():
            if not low <= getattr(self, name) <= high:
                raise InvalidConfigError(name, getattr(self, name), f"must be {low:g} to {high:g} s")
        if not FRAME_S <= self.min_voiced_s <= self.onset_window_s:
            raise InvalidConfigError("min_voiced_s", self.min_voiced_s, "must be a frame to onset_window_s")
        if self.vad_mode not in VAD_MODES:
            raise InvalidConfigError("vad_mode", self.vad_mode, "must be 0, 1, 2 or 3")


ENDPOINTER = EndpointerOptions()
