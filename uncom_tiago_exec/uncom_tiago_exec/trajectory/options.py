# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the timing of paths."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class TimingOptions:
    """How a path is timed; lengths along it are in seconds, joint coordinates divided by the joints' speed limits."""

    rate_hz: float = tunable(50.0, unit="Hz", meaning="rate at which a motion is sampled")
    jerk_ratio: float = tunable(12.0, unit="1/s", meaning="limit of the jerk, as multiple of that of the acceleration")
    corner_radius: float = tunable(0.25, unit="s", meaning="greatest length of a blend on either side of a corner")
    corner_share: float = tunable(0.499, meaning="greatest share of a segment that the blend at one of its ends takes")
    grid_step: float = tunable(0.04, unit="s", meaning="greatest length of an interval of the grid along the path")
    straight_tolerance: float = tunable(
        1e-6, meaning="greatest distance of waypoints from a line [rad, or m] with which they count as straight"
    )
    repeat_length: float = tunable(
        1e-6, unit="s", meaning="distance of two successive waypoints up to which the second is a repetition"
    )
    empty_length: float = tunable(1e-9, unit="s", meaning="length of a piece of path below which it is left out")
    flat_slope: float = tunable(1e-12, meaning="coefficient of a constraint up to which it counts as zero")
    least_speed: float = tunable(
        1e-9, meaning="sum of the path speeds at both ends of an interval up to which it counts as a standstill"
    )
    step_s: float = tunable(0.002, unit="s", meaning="step of the time grid on which the motion is averaged")
    window_factor: float = tunable(
        2.02, meaning="window of the average times jerk_ratio; 2 keeps the jerk exactly, the rest is for sampling"
    )
    rest_s: float = tunable(0.02, unit="s", meaning="duration of a motion that ends where it starts")
    last_interval: float = tunable(
        0.25, meaning="shortest last interval between two samples, as share of the others: the end is always sampled"
    )


TIMING = TimingOptions()
