# SPDX-License-Identifier: Apache-2.0
"""Numbers by which takes are judged and compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class PaperRuleOptions:
    """Values of the paper's rules as published."""

    least_score: float = tunable(0.3, meaning="least score of a detection that counts")
    retry_s: float = tunable(
        0.03, unit="s", meaning="how far from the end of a phrase another frame may be", source="paper, section III-D"
    )
    cells: int = tunable(300, meaning="Voronoi cells on the table")
    seed: int = tunable(1, meaning="seed of the cells")


@dataclass(frozen=True, slots=True)
class VerdictOptions:
    """When what was understood is what was meant."""

    overlap_m2: float = tunable(
        1e-4, unit="m^2", meaning="area by which the outlines of an object as measured and as it is differ"
    )
    same_place_m: float = tunable(0.06, unit="m", meaning="greatest distance of a detection from the object that it is")


@dataclass(frozen=True, slots=True)
class FailureStageOptions:
    """When a stage of understanding went wrong."""

    early_s: float = tunable(0.2, unit="s", meaning="how long before a pointing its rays may begin")
    late_s: float = tunable(0.3, unit="s", meaning="how long after a pointing its rays may end")
    off_deg: float = tunable(15.0, unit="deg", meaning="angle by which a ray may miss")
    off_m: float = tunable(0.05, unit="m", meaning="distance by which a ray may miss")
    score_share: float = tunable(0.3, meaning="share of the best score that the meant object's must have")

    @property
    def off_rad(self) -> float:
        """Return off_deg in radians."""
        return float(np.radians(self.off_deg))


@dataclass(frozen=True, slots=True)
class GroundTruthOptions:
    """What a detector without fault would answer."""

    sure: float = tunable(0.96, meaning="score of an object that a phrase fits")
    unsure: float = tunable(0.01, meaning="score of one that it does not fit")
    cloud_points: int = tunable(1500, meaning="points of an object's cloud, about")


PAPER_RULES = PaperRuleOptions()
VERDICTS = VerdictOptions()
FAILURE_STAGES = FailureStageOptions()
GROUND_TRUTH = GroundTruthOptions()
