# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune uncom perception."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ExposureOptions:
    """How dim and glaring pictures are brought to a usual exposure."""

    well_lit: float = tunable(160.0, meaning="grey level of the lightest surfaces of a well-lit picture, at least")
    white: float = tunable(235.0, meaning="grey level of the lightest surfaces, at most")
    usual: float = tunable(130.0, meaning="median grey level of a usual picture")
    least_gain: float = tunable(0.85, meaning="least gain")
    greatest_gain: float = tunable(4.0, meaning="greatest gain")
    dim_gain: float = tunable(1.5, meaning="gain from which a picture is worth lightening")


EXPOSURE = ExposureOptions()
