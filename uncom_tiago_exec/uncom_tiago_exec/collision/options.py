# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune collision."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class CollisionCheckerOptions:
    """How paths are checked."""

    few_states: int = tunable(
        48, meaning="up to so many states checking one by one is as fast as by the clearance around some of them"
    )
    touching_m: float = tunable(
        1e-4, unit="m", meaning="pairs this near touch; lowered margins stay this far below the distance at the start"
    )


@dataclass(frozen=True, slots=True)
class ConvexCheckerOptions:
    """Which clearance the convex covers are asked for."""

    clearances_m: tuple[float, float, float] = tunable(
        (0.06, 0.02, 0.008),
        unit="m",
        meaning="clearance asked of the farthest moving body beside its margins, greatest first",
    )
    least_shares: tuple[float, float] = tunable(
        (0.3, 0.02),
        meaning="shares of that clearance that all bodies have: against what stands still, and what the torso lifts",
    )


COLLISION_CHECKER = CollisionCheckerOptions()
CONVEX_CHECKER = ConvexCheckerOptions()
