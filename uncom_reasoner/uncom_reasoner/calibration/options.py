# SPDX-License-Identifier: Apache-2.0
"""Numbers of fitting the weights and of telling how far probabilities can be trusted."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class CalibrationOptions:
    """Reliability and scenes without an object."""

    bins: int = tunable(10, meaning="bins of probability")
    max_membership: float = tunable(0.995, meaning="greatest probability that one phrase fits one object")
    bisection_steps: int = tunable(50, meaning="steps to find the memberships behind shared scores")


@dataclass(frozen=True, slots=True)
class FitOptions:
    """Penalised maximum likelihood of the weights, and the choice of the thresholds."""

    prior_sigma: float = tunable(
        0.2, meaning="spread of the logarithm of a multiplier around 1: few takes move it little"
    )
    none_sigma: float = tunable(1.0, meaning="spread of the change of none_discount")
    absent_share: float = tunable(
        0.15, meaning="how often people speak of what is not there, for tables made by taking it away"
    )
    max_wrong_share: float = tunable(0.05, meaning="most wrong choices among the accepted ones")
    min_threshold: float = tunable(0.55, meaning="lowest min_probability that is tried")
    max_threshold: float = tunable(0.95, meaning="highest min_probability that is tried")
    threshold_steps: int = tunable(17, meaning="thresholds that are tried")
    odds_divisor: float = tunable(1.5, meaning="min_odds is the threshold's odds divided by this")
    least_odds: float = tunable(1.5, meaning="but at least this")
    min_likelihood: float = tunable(1e-6, meaning="least probability of the truth that counts")


CALIBRATION = CalibrationOptions()
FIT = FitOptions()
