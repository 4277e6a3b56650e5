# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune collision checks: margins, step along paths, and the clearances that prove paths free."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class Margins:
    """Least distances that a configuration keeps."""

    scene: float = tunable(0.01, unit="m", meaning="least distance of the arm from obstacles")
    fingers: float = tunable(0.004, unit="m", meaning="least distance of the fingers from obstacles")
    body: float = tunable(0.01, unit="m", meaning="least distance of links of the robot from one another")
    held: float = tunable(0.006, unit="m", meaning="least distance of a held object from obstacles")


@dataclass(frozen=True, slots=True)
class CollisionCheckerOptions:
    """How configurations and paths are checked."""

    step: float = tunable(
        0.005, meaning="greatest change of a joint [rad, or m] between two configurations of a path that are checked"
    )
    few_states: int = tunable(
        48, meaning="number of configurations up to which a path is checked one by one, as clearances save no time"
    )
    touching_m: float = tunable(
        1e-4,
        unit="m",
        meaning="distance up to which a pair touches; lowered margins stay at least this far below the actual distance",
    )
    lowered_share: float = tunable(0.9, meaning="share of the actual distance to which a margin is lowered")


@dataclass(frozen=True, slots=True)
class ConvexCheckerOptions:
    """Which clearances are looked for, and how they are shared among the bodies."""

    clearances_m: tuple[float, float, float] = tunable(
        (0.06, 0.02, 0.008),
        unit="m",
        meaning="clearances beyond the margins that are looked for at a configuration of a path, in this order",
    )
    least_shares: tuple[float, float] = tunable(
        (0.3, 0.02),
        meaning="least share of a clearance that a body has: against what stands still, and what the torso lifts too",
    )


MARGINS = Margins()
COLLISION_CHECKER = CollisionCheckerOptions()
CONVEX_CHECKER = ConvexCheckerOptions()
