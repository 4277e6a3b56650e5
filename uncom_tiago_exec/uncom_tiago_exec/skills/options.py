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
    speed_scale: float = tunable(0.8, meaning="largest share of the full speed of holding an object out")


@dataclass(frozen=True, slots=True)
class GraspSearchOptions:
    """The search for grasps that work from start to end."""

    efforts: tuple[int, ...] = tunable(
        (0, 2),
        meaning="restarts of inverse kinematics: first few, at grasps unlike those that failed, then more, at all",
    )
    enough: int = tunable(3, meaning="grasps that work, to choose the quickest of")
    lift_heights_m: tuple[float, ...] = tunable(
        (0.12, 0.08, 0.05), unit="m", meaning="heights of lifting what goes to a place"
    )
    hold_heights_m: tuple[float, ...] = tunable(
        (0.12, 0.1, 0.08), unit="m", meaning="heights of lifting what is only to be held"
    )
    dish_heights: tuple[float, ...] = tunable(
        (2.5, 2.1, 1.7), meaning="heights of lifting wide dishes, which hang down from their edge, in radii of the dish"
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
    lever_weight: float = tunable(
        8.0, unit="1/m", meaning="slowing of carrying per length of the lever between finger pads and object"
    )
    short_lever_m: float = tunable(0.03, unit="m", meaning="length of that lever up to which nothing is slowed")
    least_quality_speed_scale: float = tunable(
        0.35, meaning="share of the full speed at which a grasp of quality 0 is carried"
    )
    quality_speed_scale: float = tunable(0.7, meaning="share of the full speed that is added per quality of the grasp")
    slowest_carrying_speed_scale: float = tunable(
        0.45, meaning="least share of the full speed at which an object is carried"
    )
    fastest_carrying_speed_scale: float = tunable(
        0.9, meaning="largest share of the full speed at which an object is carried"
    )
    fixed_time_s: float = tunable(
        3.0, unit="s", meaning="time added to that of the free motions before it is divided by the grasp's quality"
    )
    least_quality: float = tunable(0.05, meaning="quality of a grasp below which its cost rises no further")
    quality_power: float = tunable(1.5, meaning="power of the quality by which the cost of a grasp is divided")
    squeeze_m: float = tunable(
        0.02, unit="m", meaning="gap that the fingers are closed to, less than the width of the object"
    )
    approach_speed_scale: float = tunable(0.8, meaning="share of the full speed of the straight path to the grasp")
    lift_speed_scale: float = tunable(0.75, meaning="largest share of the full speed of lifting")
    transfer_speed_scale: float = tunable(0.8, meaning="largest share of the full speed of carrying to the place")
    lower_speed_scale: float = tunable(0.6, meaning="largest share of the full speed of lowering to the place")
    retreat_speed_scale: float = tunable(
        0.9, meaning="share of the full speed of the straight path away from the object"
    )


@dataclass(frozen=True, slots=True)
class PlaceOptions:
    """When an object is rather pushed to its place than held."""

    poor_quality_again: float = tunable(
        0.35, meaning="quality of the best grasp up to which an object is pushed, once a grasp of it has failed"
    )
    poor_quality: float = tunable(0.15, meaning="quality of the best grasp up to which an object is pushed")


@dataclass(frozen=True, slots=True)
class PointOptions:
    """Poses of a pointing hand."""

    before_m: float = tunable(0.07, unit="m", meaning="distance between the finger tips and what they point at")
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
    time_s: float = tunable(3.0, unit="s", meaning="processor time of the search for a tilting motion with one grasp")
    over_m: float = tunable(0.05, unit="m", meaning="height of the mouth's lowest point over what it is poured into")
    transfer_speed_scale: float = tunable(0.6, meaning="largest share of the full speed of carrying to over the target")
    tilt_speed_scale: float = tunable(0.5, meaning="share of the full speed of tilting")
    return_speed_scale: float = tunable(0.7, meaning="share of the full speed of turning upright again")
    step_deg: float = tunable(4.0, unit="deg", meaning="angle between two poses of the tilting vessel")
    turns_deg: tuple[float, ...] = tunable(
        (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180),
        unit="deg",
        meaning="turns about the vertical that are tried",
    )
    steepest: float = tunable(-0.9, meaning="least z of the approach direction of a grasp to pour with")
    steep: float = tunable(-0.8, meaning="least z of the approach direction of grasps that are tried first")
    least_horizontal: float = tunable(
        0.3, meaning="horizontal part of the approach direction below which its lateral axis is taken"
    )


@dataclass(frozen=True, slots=True)
class PushOptions:
    """How an object is pushed over the table."""

    most_gap_m: float = tunable(0.07, unit="m", meaning="largest gap between the fingers")
    gap_share: float = tunable(
        0.55,
        meaning="gap between the fingers as a share of the object's width: both touch, and a round one stays between",
    )
    farthest_m: float = tunable(0.45, unit="m", meaning="longest push")
    before_m: float = tunable(0.025, unit="m", meaning="length of the free path before the fingers touch")
    above_m: float = tunable(0.004, unit="m", meaning="height of the finger tips over the table")
    clearance_m: float = tunable(0.012, unit="m", meaning="least distance between what is pushed and what it passes")
    tilts_deg: tuple[float, ...] = tunable(
        (0.0, 15.0, 30.0, 45.0, 60.0, -15.0), unit="deg", meaning="tilts of the hand from the vertical that are tried"
    )
    enough: int = tunable(2, meaning="pushes of one arm that work, to choose the quickest of")
    heights_m: tuple[float, ...] = tunable(
        (0.12, 0.08, 0.05), unit="m", meaning="heights from which the hand comes down, and to which it goes up"
    )
    back_m: tuple[float, ...] = tunable(
        (0.06, 0.03), unit="m", meaning="distances back from what was pushed, which may have turned"
    )
    over_m: float = tunable(
        0.05, unit="m", meaning="height of the finger tips over what was pushed, before the arm turns away"
    )
    voxel_m: float = tunable(0.008, unit="m", meaning="side of the cubes of which each keeps one point of the object")
    table_margin_m: float = tunable(
        0.03, unit="m", meaning="least distance of the object's middle from the table's edge"
    )
    above_top_m: float = tunable(
        0.01, unit="m", meaning="height over the object's top below which others are in its way"
    )
    check_step_m: float = tunable(0.02, unit="m", meaning="distance between positions that are checked for contact")
    there_m: float = tunable(0.01, unit="m", meaning="distance from its place below which an object is there already")
    finger_width_m: float = tunable(
        0.01, unit="m", meaning="distance from a finger's line up to which points of the object count as touched"
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
        0.055, unit="m", meaning="distance from other objects: a finger, and the error of the camera"
    )
    least_clearance_m: float = tunable(
        0.03, unit="m", meaning="least distance from other objects, where no freer place is as near"
    )
    clearance_weight: float = tunable(
        5.0, meaning="length of path that is as bad as a unit length of missing clearance"
    )
    apart_m: float = tunable(0.07, unit="m", meaning="least distance between two places that are tried")
    most_places: int = tunable(4, meaning="places that are tried")
    least_way_m: float = tunable(
        0.05, unit="m", meaning="least distance of a place from where the object is, and from where it goes"
    )


@dataclass(frozen=True, slots=True)
class ReleaseOptions:
    """How what is held is let go."""

    enough: int = tunable(3, meaning="poses at the place that can be reached, to choose the nearest of")
    opening_m: float = tunable(
        0.03, unit="m", meaning="gap that the fingers open to, more than the width of the object"
    )
    least_retreat_m: float = tunable(0.08, unit="m", meaning="least length of the straight path out after the release")
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
        0.15,
        unit="m",
        meaning="distance beyond the middle, to the other arm's side, over which the worth falls by a factor e",
    )
    far_m: float = tunable(0.7, unit="m", meaning="distance from the shoulder beyond which steep grasps are worth less")
    steep: float = tunable(0.7, meaning="downward part of an approach direction that is steep")
    steep_weight: float = tunable(
        8.0, unit="1/m", meaning="fall of the worth's logarithm per distance beyond far_m and excess over steep"
    )
    least_facing: float = tunable(
        0.6, meaning="factor of the worth for a hand at right angles to the line from the shoulder"
    )
    facing_weight: float = tunable(0.4, meaning="factor that is added by the cosine of the hand's turn from that line")
    shoulder_x_m: float = tunable(-0.03, unit="m", meaning="x of the shoulders in the robot's base frame")
    plan_slack: float = tunable(2.0, meaning="factor on alike_m and alike_rad for grasps like that of an earlier plan")


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
