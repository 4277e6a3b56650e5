# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune kinematics."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class AnalyticIkOptions:
    """When an arm can be solved in closed form."""

    meeting_tolerance_m: float = tunable(1e-6, unit="m", meaning="distance up to which two axes meet")
    singular_sine: float = tunable(1e-9, meaning="sine of joint 6 below which joints 5 and 7 turn about one axis")
    axis_tolerance: float = tunable(1e-07, meaning="how exactly the axes have to meet [m, or of a unit vector]")


@dataclass(frozen=True, slots=True)
class CartesianPathOptions:
    """How straight motions of the hand are followed."""

    step_m: float = tunable(0.01, unit="m", meaning="distance between two poses on the line")
    check_rad: float = tunable(
        0.02,
        unit="rad",
        meaning="distance between checks for collisions; the timed motion is checked again, more closely",
    )
    largest_jump_rad: float = tunable(
        0.25, unit="rad", meaning="a step of 1 cm never needs more of a joint, unless the arm flips"
    )
    largest_torso_jump_m: float = tunable(0.04, unit="m", meaning="the same for the torso")
    turned: float = tunable(1e-09, meaning="difference of two rotations' entries above which they are not the same")


@dataclass(frozen=True, slots=True)
class IkSearchOptions:
    """Where the closed form is evaluated."""

    restarts: int = tunable(20, meaning="random restarts of the numerical solver")
    distinct: float = tunable(0.3, meaning="difference of a joint [rad, or m] from which two solutions are distinct")
    rounds: tuple[int, int, int] = tunable(
        (20, 96, 512), meaning="pairs of torso height and first joint looked at, one round after another"
    )
    nearby_m: float = tunable(
        0.2,
        unit="m",
        meaning="length of a straight line whose end is near enough for the detours tried to be all there are",
    )
    limit_margin: float = tunable(0.06, meaning="share of a joint's range next to a limit that is better avoided")
    torso_detours_m: tuple[float, ...] = tunable(
        (0.0, -0.03, 0.03, -0.06, 0.06, -0.1, 0.1),
        unit="m",
        meaning="how far the torso is tried to go while the hand goes straight",
    )
    shoulder_detours_rad: tuple[float, ...] = tunable(
        (0.0, -0.1, 0.1, -0.2, 0.2, -0.35, 0.35, -0.5, 0.5),
        unit="rad",
        meaning="how far the first joint is tried to go meanwhile",
    )


@dataclass(frozen=True, slots=True)
class NumericalIkOptions:
    """When an iteration has converged."""

    position_tolerance_m: float = tunable(0.0005, unit="m", meaning="greatest error of the position")
    rotation_tolerance_rad: float = tunable(0.005, unit="rad", meaning="greatest error of the rotation")
    largest_step: float = tunable(0.8, meaning="greatest change of a joint in one iteration [rad, or m]")


ANALYTIC_IK = AnalyticIkOptions()
CARTESIAN_PATH = CartesianPathOptions()
IK_SEARCH = IkSearchOptions()
NUMERICAL_IK = NumericalIkOptions()
