# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune trajectory."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class TimingOptions:
    """How a path is timed."""

    repeat_length: float = tunable(
        1e-6, meaning="distance of two waypoints, in joint coordinates over the speed limits, up to which they are one"
    )
    empty_length: float = tunable(1e-9, meaning="length of a piece of path, so measured, below which it is left out")
    flat_slope: float = tunable(1e-12, meaning="coefficient of a limit up to which it counts as zero")
    least_speed: float = tunable(1e-9, meaning="sum of the path speeds at the ends of an interval that is a standstill")
    step_s: float = tunable(0.002, unit="s", meaning="step of the time grid on which limits are held")


TIMING = TimingOptions()
