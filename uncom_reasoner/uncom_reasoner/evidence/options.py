# SPDX-License-Identifier: Apache-2.0
"""Numbers of choosing frames and of waiting for gestures."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class SensorMemoryOptions:
    """Which of the remembered images and hands belong together, and which belong to a command."""

    same_frame_s: float = tunable(
        0.05, unit="s", meaning="largest difference of stamps at which image, depth and hands count as one frame"
    )
    ahead_age_s: float = tunable(
        4.0, unit="s", meaning="a frame this long before the words still shows what is spoken of"
    )
    hands_margin_s: float = tunable(2.0, unit="s", meaning="hands this long before and after the words are looked at")
    hands_after_words_s: float = tunable(
        5.0, unit="s", meaning="hands up to this long after the last word count when a frame without hands is chosen"
    )
    clock_jump_s: float = tunable(
        1.0, unit="s", meaning="a stamp this much older than the newest one means that the clock started again"
    )


@dataclass(frozen=True, slots=True)
class GestureTimingOptions:
    """When the hands that were seen are enough to decide on a command.

    How long a pointing that comes late is waited for is the node's parameter `late_pointing_s`.
    """

    sufficient_weight: float = tunable(
        2.0, meaning="a gesture with this many frames' weight (see Dwell.stillness) needs no more frames"
    )
    dominant_share: float = tunable(0.6, meaning="least share of a phrase's gesture that its main dwell must have")
    settling_s: float = tunable(
        0.25, unit="s", meaning="hands known this long after the last word are enough where the gestures are there"
    )
    named_lead_s: float = tunable(
        0.1, unit="s", meaning="hands may end this long before the last word where no gesture is needed"
    )


SENSOR_MEMORY = SensorMemoryOptions()
GESTURE_TIMING = GestureTimingOptions()
