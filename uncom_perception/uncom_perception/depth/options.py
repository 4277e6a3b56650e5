# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune depth."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class DepthScaleOptions:
    """How an estimated depth is scaled to the height of the camera over the table."""

    stride: int = tunable(4, unit="px", meaning="every so manieth pixel is looked at")
    least_scale: float = tunable(0.4, meaning="least scale; beyond, what was taken for the table is something else")
    greatest_scale: float = tunable(2.5, meaning="greatest scale")
    least_height_m: float = tunable(
        1e-3, unit="m", meaning="height of the camera over the table below which nothing is scaled"
    )


DEPTH_SCALE = DepthScaleOptions()
