# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune inverse kinematics and straight motions of the hand."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class AnalyticIkOptions:
    """When an arm counts as one that has a closed-form solution."""

    meeting_tolerance_m: float = tunable(1e-6, unit="m", meaning="distance up to which two axes count as meeting")
    axis_tolerance: float = tunable(
        1e-07, meaning="error up to which the entries of a direction or rotation count as equal to the required ones"
    )
    singular_sine: float = tunable(
        1e-9, meaning="sine of joint 6 below which joints 5 and 7 count as turning about one axis"
    )


@dataclass(frozen=True, slots=True)
class CartesianPathOptions:
    """How straight motions of the hand are followed."""

    step_m: float = tunable(0.01, unit="m", meaning="greatest distance between two successive poses on the line")
    turn_step_rad: float = tunable(0.05, unit="rad", meaning="greatest rotation between two successive poses")
    iterations: int = tunable(
        15, meaning="iterations of the numerical solver for each pose where the closed form does not lead on"
    )
    check_rad: float = tunable(
        0.02,
        unit="rad",
        meaning="distance between collision checks; the timed motion is checked again at smaller steps",
    )
    largest_jump_rad: float = tunable(
        0.25, unit="rad", meaning="change of an arm joint between two poses above which the arm changes its posture"
    )
    largest_torso_jump_m: float = tunable(
        0.04, unit="m", meaning="change of the torso between two poses above which the motion is refused"
    )
    same_rotation: float = tunable(
        1e-09, meaning="difference of the entries of two rotation matrices up to which they count as equal"
    )


@dataclass(frozen=True, slots=True)
class IkSearchOptions:
    """At which torso heights and first joints the closed form is evaluated, and which solutions are preferred."""

    rounds: tuple[int, int, int] = tunable(
        (20, 96, 512), meaning="pairs of torso height and first joint in each round; a later one only if needed"
    )
    raised_samples: int = tunable(
        40, meaning="pairs of the second round with the torso at its upper limit, for poses that need reach from above"
    )
    restarts: int = tunable(20, meaning="random starts of the numerical solver after the last round")
    distinct: float = tunable(0.3, meaning="least difference of a joint [rad, or m] between two returned solutions")
    limit_margin: float = tunable(
        0.06, meaning="distance from a joint limit, as share of the range, below which a solution gets a cost"
    )
    nearby_m: float = tunable(
        0.2,
        unit="m",
        meaning="length of a straight line below which the detours tried prove that its end is out of reach",
    )
    torso_detours_m: tuple[float, ...] = tunable(
        (0.0, -0.03, 0.03, -0.06, 0.06, -0.1, 0.1),
        unit="m",
        meaning="changes of the torso height tried over a straight line",
    )
    shoulder_detours_rad: tuple[float, ...] = tunable(
        (0.0, -0.1, 0.1, -0.2, 0.2, -0.35, 0.35, -0.5, 0.5),
        unit="rad",
        meaning="changes of the first joint tried over a straight line",
    )


@dataclass(frozen=True, slots=True)
class NumericalIkOptions:
    """How the numerical solver iterates, and when it has converged."""

    position_tolerance_m: float = tunable(
        0.0005, unit="m", meaning="accepted error of the position; one coordinate may have half of it"
    )
    rotation_tolerance_rad: float = tunable(
        0.005, unit="rad", meaning="accepted error of the rotation; that about one axis may be half of it"
    )
    largest_step: float = tunable(0.8, meaning="greatest change of a joint in one iteration [rad, or m]")
    iterations: int = tunable(50, meaning="greatest number of iterations from one start")
    stalled_iterations: int = tunable(5, meaning="successive iterations without progress after which it gives up")
    progress_share: float = tunable(
        0.9, meaning="share of the least squared error so far below which an iteration counts as progress"
    )
    torso_weight: float = tunable(
        0.04, meaning="weight of the torso in a step, arm joints have 1: 0.1 m of it cost as much as 0.5 rad of a joint"
    )
    initial_damping: float = tunable(1e-4, meaning="damping of the first step")
    least_damping: float = tunable(1e-7, meaning="lower bound of the damping")
    greatest_damping: float = tunable(1.0, meaning="upper bound of the damping")
    damping_decrease: float = tunable(0.2, meaning="factor of the damping after a step that lessens the error")
    damping_increase: float = tunable(8.0, meaning="factor of the damping after a step that does not")


ANALYTIC_IK = AnalyticIkOptions()
CARTESIAN_PATH = CartesianPathOptions()
IK_SEARCH = IkSearchOptions()
NUMERICAL_IK = NumericalIkOptions()
