# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune styles."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class PointingStyleOptions:
    """When fingers point, and when they say something else."""

    together_rad: float = tunable(
        0.2, unit="rad", meaning="fingers of a hand that says stop or shows its palm are spread wider"
    )
    flat_hand_weight: float = tunable(0.7, meaning="a flat hand is as often a greeting")
    plain_extension: float = tunable(0.5, meaning="extension in the image from which a finger is plainly out there")
    side_by_side_rad: float = tunable(
        0.15,
        unit="rad",
        meaning="fingers held side by side differ by less; a narrow V by 0.16 rad, a usual one by 0.35",
    )


POINTING_STYLE = PointingStyleOptions()
