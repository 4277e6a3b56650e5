# SPDX-License-Identifier: Apache-2.0
"""What tunes the skills: which alternatives are tried, and what is preferred among them."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class GiveOptions:
    """Where an object is held out to the person."""

    places_m: tuple[tuple[float, float, float], ...] = tunable(
        ((0.62, 0.18, 0.34), (0.56, 0.15, 0.3), (0.5, 0.2, 0.3), (0.56, 0.3, 0.25)),
        unit="m",
        meaning="places that are tried: ahead, to the arm's side, over the table",
    )
    turns_deg: tuple[float, ...] = tunable(
        (0, 30, -30, 60, -60, 90, -90, 135, -135, 180), unit="deg", meaning="turns about the vertical that are tried"
    )


@dataclass(frozen=True, slots=True)
class GraspSearchOptions:
    """The search for grasps that work from start to end."""

    efforts: tuple[int, ...] = tunable(
        (0, 2), meaning="restarts of inverse kinematics: a quick look at different grasps, then a thorough one at all"
    )
    enough: int = tunable(3, meaning="grasps that work, to choose the quickest of")
    lift_heights_m: tuple[float, ...] = tunable(
        (0.12, 0.08, 0.05), unit="m", meaning="heights of lifting what goes to a place"
    )
    hold_heights_m: tuple[float, ...] = tunable(
        (0.12, 0.1, 0.08), unit="m", meaning="heights of lifting what is only to be held"
    )
    dish_heights: tuple[float, ...] = tunable(
        (2.5, 2.1, 1.7), meaning="the same for wide dishes, which hang down from their edge, in radii"
    )
    wide_dish_m: float = tunable(0.06, unit="m", meaning="radius over which a dish is wide")


@dataclass(frozen=True, slots=True)
class GraspingOptions:
    """The choice among grasps that work."""

    most_detour: float = tunable(
        1.9, meaning="duration over the least that the motions could take, beyond which another grasp is looked at"
    )


@dataclass(frozen=True, slots=True)
class MotionStepOptions:
    """The timed steps of a plan."""

    contact_tolerance: float = tunable(
        0.05, unit="rad, m", meaning="lag of a joint in a slow motion that tells that something holds it up"
    )


@dataclass(frozen=True, slots=True)
class PlaceOptions:
    """When an object is rather pushed to its place than held."""

    poor_quality_again: float = tunable(0.35, meaning="the same once a grasp has failed")
    poor_quality: float = tunable(0.15, meaning="quality of the best grasp up to which it is pushed where it can be")


@dataclass(frozen=True, slots=True)
class PointOptions:
    """Poses of a pointing hand."""

    before_m: float = tunable(0.07, unit="m", meaning="between the finger tips and what they point at")
    pitches_deg: tuple[float, ...] = tunable(
        (40.0, 55.0, 70.0, 25.0, 85.0), unit="deg", meaning="angles below the horizontal that are tried"
    )
    yaws_deg: tuple[float, ...] = tunable(
        (0.0, 20.0, -20.0, 45.0, -45.0), unit="deg", meaning="turns from the line from the shoulder that are tried"
    )


@dataclass(frozen=True, slots=True)
class PourOptions:
    """How a vessel is tilted over a target."""

    tilts_deg: tuple[float, ...] = tunable(
        (115.0, 100.0), unit="deg", meaning="tilts; the second where the first cannot be reached"
    )
    time_s: float = tunable(3.0, unit="s", meaning="processor time to look for a way to tilt with one grasp")
    over_m: float = tunable(0.05, unit="m", meaning="of the mouth's lowest point over what it is poured into")
    step_deg: float = tunable(4.0, unit="deg", meaning="between two poses of the tilting vessel")
    turns_deg: tuple[float, ...] = tunable(
        (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180),
        unit="deg",
        meaning="turns about the vertical that are tried",
    )
    steepest: float = tunable(-0.9, meaning="least z of the approach direction of a grasp to pour with")
    steep: float = tunable(-0.8, meaning="the same of grasps that are tried first")
    least_horizontal: float = tunable(
        0.3, meaning="horizontal part of the approach direction below which its lateral axis is taken"
    )


@dataclass(frozen=True, slots=True)
class PushOptions:
    """How an object is pushed over the table."""

    most_gap_m: float = tunable(0.07, unit="m", meaning="between the fingers at most")
    gap_share: float = tunable(
        0.55,
        meaning="the same as a share of the object's width: both fingers touch, and what is round stays between them",
    )
    farthest_m: float = tunable(0.45, unit="m", meaning="longest push")
    before_m: float = tunable(0.025, unit="m", meaning="free way before the fingers touch")
    above_m: float = tunable(0.004, unit="m", meaning="of the finger tips over the table")
    clearance_m: float = tunable(0.012, unit="m", meaning="between what is pushed and what it passes")
    tilts_deg: tuple[float, ...] = tunable(
        (0.0, 15.0, 30.0, 45.0, 60.0, -15.0), unit="deg", meaning="tilts of the hand from the vertical that are tried"
    )
    enough: int = tunable(2, meaning="pushes of one arm that work, to choose the quickest of")
    heights_m: tuple[float, ...] = tunable(
        (0.12, 0.08, 0.05), unit="m", meaning="heights from which the hand comes down, and to which it goes up"
    )
    back_m: tuple[float, ...] = tunable(
        (0.06, 0.03), unit="m", meaning="ways back from what was pushed, which may have turned"
    )
    over_m: float = tunable(
        0.05, unit="m", meaning="of the finger tips over what was pushed, before the arm turns away"
    )
    there_m: float = tunable(0.01, unit="m", meaning="distance from its place below which an object is there already")
    finger_width_m: float = tunable(
        0.01, unit="m", meaning="from a finger's line that points of the object count as touched"
    )


@dataclass(frozen=True, slots=True)
class RelayOptions:
    """Where one arm sets an object down for the other."""

    x_m: tuple[float, ...] = tunable(
        tuple(0.46 + 0.03 * i for i in range(9)), unit="m", meaning="distances ahead of places that both arms reach"
    )
    y_m: tuple[float, ...] = tunable(
        tuple(0.03 * i for i in range(-6, 7)), unit="m", meaning="distances to the left of such places"
    )
    clearance_m: float = tunable(
        0.055, unit="m", meaning="from other objects: a finger, and what the camera gets wrong"
    )
    least_clearance_m: float = tunable(0.03, unit="m", meaning="from other objects, where nothing freer is as near")
    clearance_weight: float = tunable(5.0, meaning="length of way that a length of lacking clearance is worth")
    apart_m: float = tunable(0.07, unit="m", meaning="between two places that are tried")
    most_places: int = tunable(4, meaning="places that are tried")
    least_way_m: float = tunable(
        0.05, unit="m", meaning="from where the object is, and from where it goes, of a place between"
    )


@dataclass(frozen=True, slots=True)
class ReleaseOptions:
    """How what is held is let go."""

    enough: int = tunable(3, meaning="poses at the place that can be reached, to choose the nearest of")
    heights_m: tuple[float, ...] = tunable(
        (0.1, 0.07, 0.04), unit="m", meaning="heights over the place from which the hand comes straight down"
    )


@dataclass(frozen=True, slots=True)
class GraspOrderOptions:
    """The worth of pairs of arm and grasp, and when two grasps are alike."""

    alike_m: float = tunable(0.015, unit="m", meaning="distance below which two hand poses are alike")
    alike_rad: float = tunable(0.35, unit="rad", meaning="turn below which two hand poses are alike")
    quality_power: float = tunable(1.5, meaning="power of the quality in the worth")
    crossing_m: float = tunable(
        0.15, unit="m", meaning="beyond the middle to the other arm's side by which the worth falls by e"
    )
    far_m: float = tunable(0.7, unit="m", meaning="from the shoulder beyond which steep grasps are worth less")
    steep: float = tunable(0.7, meaning="downward part of an approach direction that is steep")
    steep_weight: float = tunable(8.0, meaning="weight of far and steep")


GIVE = GiveOptions()
GRASP_SEARCH = GraspSearchOptions()
GRASPING = GraspingOptions()
MOTION_STEPS = MotionStepOptions()
PLACE = PlaceOptions()
POINT = PointOptions()
POUR = PourOptions()
PUSH = PushOptions()
RELAY = RelayOptions()
RELEASE = ReleaseOptions()
GRASP_ORDER = GraspOrderOptions()
