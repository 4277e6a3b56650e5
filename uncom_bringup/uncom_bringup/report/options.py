# SPDX-License-Identifier: Apache-2.0
"""Numbers of the report, the comparison of runs and the video: layout and what is left out."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ResultOptions:
    """How results are written."""

    digits: int = tunable(6, meaning="digits behind the point of every number")


@dataclass(frozen=True, slots=True)
class ComparisonOptions:
    """How candidates of two runs are matched."""

    min_overlap: float = tunable(0.5, meaning="least intersection over union of the boxes of one object in two runs")


@dataclass(frozen=True, slots=True)
class PageOptions:
    """What the page shows."""

    max_candidates: int = tunable(12, meaning="likeliest candidates in a table, beside the chosen one")
    max_list_values: int = tunable(8, meaning="longer lists of a stage are shown by their length only")
    max_value_chars: int = tunable(120, meaning="longer values of a stage are cut off")


@dataclass(frozen=True, slots=True)
class MapOptions:
    """Layout of the map of the table."""

    width_px: float = tunable(620.0, unit="px", meaning="width of the drawing")
    margin_px: float = tunable(26.0, unit="px", meaning="space around the table")
    ray_m: float = tunable(2.0, unit="m", meaning="longest pointing ray that is drawn")


@dataclass(frozen=True, slots=True)
class TimelineOptions:
    """Layout of the words and rays over time."""

    width_px: float = tunable(980.0, unit="px", meaning="width of the drawing")
    height_px: float = tunable(196.0, unit="px", meaning="height of the drawing")
    left_px: float = tunable(96.0, unit="px", meaning="space for the names of the rows")
    right_px: float = tunable(16.0, unit="px", meaning="space at the right")
    words_y_px: float = tunable(44.0, unit="px", meaning="height of the row of words")
    hands_y_px: float = tunable(96.0, unit="px", meaning="height of the row of hands")
    object_y_px: float = tunable(126.0, unit="px", meaning="height of the row of the object's rays")
    target_y_px: float = tunable(156.0, unit="px", meaning="height of the row of the target's rays")
    before_s: float = tunable(0.8, unit="s", meaning="time shown before the first word")
    after_s: float = tunable(1.2, unit="s", meaning="time shown after the last word")
    fine_ticks_below_s: float = tunable(
        8.0, unit="s", meaning="shorter spans have a tick each half second, longer ones each second"
    )


@dataclass(frozen=True, slots=True)
class ReliabilityOptions:
    """Layout of the reliability diagram."""

    size_px: float = tunable(300.0, unit="px", meaning="side of the square")
    margin_px: float = tunable(42.0, unit="px", meaning="space at its left and right")


@dataclass(frozen=True, slots=True)
class VideoOptions:
    """Layout and encoding of the video."""

    rate_hz: int = tunable(8, unit="Hz", meaning="pictures a second")
    width_px: int = tunable(640, unit="px", meaning="width of one view")
    height_px: int = tunable(480, unit="px", meaning="height of one view")
    captions_px: int = tunable(92, unit="px", meaning="height of the captions below")
    margin_px: int = tunable(14, unit="px", meaning="space at the left of the captions")
    rate_factor: int = tunable(24, meaning="constant rate factor of the encoder: lower is better and larger")


RESULT = ResultOptions()
COMPARISON = ComparisonOptions()
PAGE = PageOptions()
MAP = MapOptions()
TIMELINE = TimelineOptions()
RELIABILITY = ReliabilityOptions()
VIDEO = VideoOptions()
