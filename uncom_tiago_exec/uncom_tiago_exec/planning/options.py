# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune planning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ArmPlannerOptions:
    """How motions of one arm are planned."""

    free_finger_margin_m: float = tunable(
        0.008,
        unit="m",
        meaning="distance that fingers keep from everything on free motions: little is gained by going nearer",
    )
    gap_step_m: float = tunable(
        0.01, unit="m", meaning="step of the finger openings that are planned with; the wider one is taken"
    )


@dataclass(frozen=True, slots=True)
class CarryPlannerOptions:
    """How held objects are kept upright."""

    leans_rad: tuple[float, float] = tunable(
        tuple(np.radians([25.0, 50.0]).tolist()), unit="rad", meaning="limits of the lean, tried one after the other"
    )
    more_lean_rad: float = tunable(
        np.radians(5.0), unit="rad", meaning="lean allowed beyond that at either end of a motion"
    )
    lean_step_rad: float = tunable(
        0.05, unit="rad", meaning="distance between two configurations whose lean is looked at"
    )
    straight_limit_s: float = tunable(
        4.0, unit="s", meaning="duration at full speed that a straight joint motion may take"
    )
    search_time_s: float = tunable(0.25, unit="s", meaning="planning time for each limit of the lean")


ARM_PLANNER = ArmPlannerOptions()
CARRY_PLANNER = CarryPlannerOptions()
