# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the planning of motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class PlannerOptions:
    """Budgets of a search for a path."""

    time_s: float = tunable(1.0, unit="s", meaning="processor time for the search of one path")
    rounds: int = tunable(4, meaning="greatest number of rounds of shortcuts: 1 simplifies lightly, 20 fully")
    simplify_s: float = tunable(0.5, unit="s", meaning="processor time after which no further round begins")
    gain: float = tunable(
        0.03, meaning="share of its length by which a round has to shorten the path for another one to follow"
    )


@dataclass(frozen=True, slots=True)
class ArmPlannerOptions:
    """How motions of one arm are planned and timed."""

    free_finger_margin_m: float = tunable(
        0.008,
        unit="m",
        meaning="least distance of the fingers from obstacles on motions that need no contact",
    )
    gap_step_m: float = tunable(
        0.01, unit="m", meaning="step of the finger openings for which a model is made; the next wider one is taken"
    )
    finger_limit_m: float = tunable(0.045, unit="m", meaning="greatest position of a finger in such a model")
    search_share: float = tunable(0.5, meaning="share of the node's planning time that the search of one path may take")
    corner_radii: tuple[float, ...] = tunable(
        (0.6, 0.25, 0.1, 0.03, 0.01),
        unit="s",
        meaning="greatest lengths of corner blends, at full speed, tried until the timed motion is free",
    )


@dataclass(frozen=True, slots=True)
class CarryPlannerOptions:
    """How held objects are kept upright."""

    leans_rad: tuple[float, float] = tunable(
        tuple(np.radians([25.0, 50.0]).tolist()),
        unit="rad",
        meaning="limits of the lean of the object, tried one after the other",
    )
    more_lean_rad: float = tunable(
        np.radians(5.0), unit="rad", meaning="lean allowed in addition to the larger one at the ends of a motion"
    )
    lean_step_rad: float = tunable(
        0.05,
        unit="rad",
        meaning="greatest change of a joint between two configurations of a path whose lean is checked",
    )
    straight_limit_s: float = tunable(
        4.0, unit="s", meaning="duration at full speed above which a straight motion of the hand is not used"
    )
    search_time_s: float = tunable(0.25, unit="s", meaning="processor time of the search for each limit of the lean")


PLANNER = PlannerOptions()
ARM_PLANNER = ArmPlannerOptions()
CARRY_PLANNER = CarryPlannerOptions()
