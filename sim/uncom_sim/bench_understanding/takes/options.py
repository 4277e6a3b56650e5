# SPDX-License-Identifier: Apache-2.0
"""Numbers of the takes."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ObjectPlacementOptions:
    """Where the objects of a take are put."""

    gap_m: float = tunable(0.045, unit="m", meaning="least gap between any two objects")
    free_m: float = tunable(0.03, unit="m", meaning="room about an object where it is to go")
    x_m: tuple[float, float] = tunable((0.50, 0.88), unit="m", meaning="range of x of objects")
    y_m: float = tunable(0.42, unit="m", meaning="greatest |y| of objects")
    reach_x_m: tuple[float, float] = tunable((0.50, 0.73), unit="m", meaning="range of x of what is asked for")
    reach_y_m: float = tunable(0.40, unit="m", meaning="greatest |y| of what is asked for")
    tries: int = tunable(80, meaning="places that are tried for an object")
    beside_m: float = tunable(0.03, unit="m", meaning="gap of an object put beside another")
    largest_radius_m: float = tunable(
        0.07, unit="m", meaning="radius that is enough for any object, as a long one can be turned"
    )
    free_radius_m: float = tunable(0.10, unit="m", meaning="least distance of a free place from all objects")
    room_gap_m: float = tunable(
        0.02, unit="m", meaning="gap from other objects and from the edge that a place beside another needs"
    )


@dataclass(frozen=True, slots=True)
class TakePlanningOptions:
    """How takes are planned."""

    attempts: int = tunable(600, meaning="arrangements that are tried")
    early_below: float = tunable(0.15, meaning="draws below this, of 0 to 1, make the person point early")
    late_below: float = tunable(0.30, meaning="of the other draws, those below this make the person point late")
    wavering_below: float = tunable(0.45, meaning="of the other draws, those below this make the hand waver")


@dataclass(frozen=True, slots=True)
class FilmingOptions:
    """How a take is filmed."""

    start_s: float = tunable(100.0, unit="s", meaning="stamp of the beginning of every take")
    rate_hz: float = tunable(8.0, unit="Hz", meaning="pictures in a second, as of the simulated robot's camera")
    after_words_s: float = tunable(
        1.5, unit="s", meaning="how long pictures go on after the last word; what comes later has no meaning for it"
    )
    blur_px: float = tunable(1.5, unit="px", meaning="motion during the exposure from which on it is drawn")
    fast_px: float = tunable(10.0, unit="px", meaning="motion from which on five moments are drawn instead of three")


OBJECT_PLACEMENT = ObjectPlacementOptions()
TAKE_PLANNING = TakePlanningOptions()
FILMING = FilmingOptions()
