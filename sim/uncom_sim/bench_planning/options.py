# SPDX-License-Identifier: Apache-2.0
"""Numbers of the planning benchmark."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ProblemOptions:
    """What is planned, and how it is timed and checked."""

    rounds: int = tunable(3, meaning="rounds of which the fastest counts")
    recheck_rad: float = tunable(0.005, unit="rad", meaning="distance of the states at which a path is checked again")
    reach_m: float = tunable(1e-3, unit="m", meaning="greatest error of the place of a solved pose")
    reach_rad: float = tunable(0.01, unit="rad", meaning="greatest error of the orientation of a solved pose")
    plan_limit_s: float = tunable(1.0, unit="s", meaning="time in which a plan must be found")
    checks: int = tunable(2000, meaning="states that are checked for collisions")
    inset_m: float = tunable(
        0.0041, unit="m", meaning="by how much the solids are made smaller, so that touching is no collision"
    )
    near_x_m: tuple[float, float] = tunable(
        (0.5, 0.68), unit="m", meaning="range of x of what is picked and where it is placed"
    )
    points: int = tunable(2500, meaning="points drawn on each surface")
    place_gap_m: float = tunable(0.15, unit="m", meaning="least distance of two objects")
    least_move_m: float = tunable(0.2, unit="m", meaning="least way of a pick-and-place")
    into_share: float = tunable(0.5, meaning="share of tasks that go into a bowl")


@dataclass(frozen=True, slots=True)
class MplibOptions:
    """How mplib is run in its own process."""

    budget_s: float = tunable(
        60.0, unit="s", meaning="time for all that it does; what is not begun by then is left out"
    )
    patience_s: float = tunable(60.0, unit="s", meaning="time beyond that, for loading and for the plan begun last")
    seed: int = tunable(1, meaning="seed of its random numbers")


@dataclass(frozen=True, slots=True)
class RoboplanOptions:
    """How roboplan solves the same problems."""

    restarts: int = tunable(20, meaning="random restarts of its inverse kinematics")
    shortcuts: int = tunable(200, meaning="iterations of its path shortcutting")


PROBLEMS = ProblemOptions()
MPLIB = MplibOptions()
ROBOPLAN = RoboplanOptions()
