# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the choice of grasps and of poses at which objects are released."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class GraspQualityOptions:
    """Factors of the quality of a grasp, most of which are 1 for a good grasp and fall off linearly."""

    sheet_kg_m2: float = tunable(
        11.0, unit="kg/m^2", meaning="mass of the surface of dishes: 4 to 5 mm of ceramic, 1.5 mm of steel"
    )
    pad_force_n: float = tunable(10.0, unit="N", meaning="force of one pad that can be relied on")
    contact_depth_m: float = tunable(
        0.004, unit="m", meaning="distance from the outermost point between the pads up to which a point is in contact"
    )
    pad_end_m: float = tunable(0.01, unit="m", meaning="length at the edge of a pad over which the taper is measured")
    slip_taper: float = tunable(
        0.7, meaning="widening towards one side per length beyond which an object slips out, of any material"
    )
    least_taper_factor: float = tunable(0.2, meaning="factor of a grasp at such a taper")
    width_error_m: float = tunable(0.003, unit="m", meaning="error of a measured width")
    clearance_scale_m: float = tunable(
        0.015, unit="m", meaning="clearance of the open fingers, beyond that error, from which on the factor is 1"
    )
    least_clearance_factor: float = tunable(0.4, meaning="factor of a grasp whose open fingers just pass the object")
    rim_factor: float = tunable(0.85, meaning="factor of grasps at a rim compared with those across a body")
    rim_pitch_exponent: float = tunable(1.5, meaning="exponent of the sine of the pitch in grasps at a rim")
    slant_width_m: float = tunable(0.012, unit="m", meaning="width by which the slant is divided for thinner objects")
    slant_weight: float = tunable(2.0, meaning="weight of the squared slant of the contacts in the exponential")
    patch_length_weight: float = tunable(0.5, meaning="weight of a contact's length along the fingers against across")
    patch_scale_m: float = tunable(0.03, unit="m", meaning="size of the contacts per unit of their factor")
    least_contact_factor: float = tunable(0.3, meaning="factor of contacts in one point")
    depth_scale_m: float = tunable(0.025, unit="m", meaning="depth of the object between the fingers per unit factor")
    least_depth_factor: float = tunable(0.4, meaning="factor of an object that only the finger tips reach")
    easy_width_m: float = tunable(0.06, unit="m", meaning="width up to which the factor of the width is 1")
    width_scale_m: float = tunable(0.035, unit="m", meaning="further width per unit by which the factor falls")
    least_width_factor: float = tunable(0.3, meaning="least factor of the width")
    lever_scale_m: float = tunable(
        0.08, unit="m", meaning="distance of the centre from the line between the pads at which the factor is 1/e"
    )
    offset_scale_m: float = tunable(
        0.4, unit="m", meaning="horizontal distance of the centre from the grasp at which the factor is 1/e"
    )
    approach_factor: float = tunable(0.8, meaning="factor of a horizontal approach")
    approach_pitch_gain: float = tunable(0.2, meaning="what is added to it times the sine of the pitch")
    height_scale_m: float = tunable(0.25, unit="m", meaning="height above the centre per unit of the height factor")
    height_factors: tuple[float, float] = tunable(
        (0.7, 1.05), meaning="bounds of the height factor, for grasps below and above the centre"
    )
    swing_height_m: float = tunable(
        0.04, unit="m", meaning="height above the centre beyond which the object swings below the hand"
    )
    swing_weight: float = tunable(4.0, unit="1/m", meaning="weight of further height in the divisor of that factor")
    hidden_edge_loss: float = tunable(
        0.4, meaning="what the factor of an edge on the side away from the camera loses: a handle may be hidden there"
    )


@dataclass(frozen=True, slots=True)
class GraspSamplerOptions:
    """Which grasps are proposed, and which of them are rejected."""

    max_per_family: int = tunable(120, meaning="greatest number of grasps of one family that are returned")
    neighbour_reach_m: float = tunable(
        0.2, unit="m", meaning="distance beyond half the size of the object up to which neighbours are regarded"
    )
    neighbour_voxel_m: float = tunable(0.007, unit="m", meaning="spacing to which the points of neighbours are thinned")
    pitches_deg: tuple[float, ...] = tunable(
        (90.0, 75.0, 60.0, 48.0, 36.0), unit="deg", meaning="pitches of the hand; 90 is straight down"
    )
    yaw_step_deg: float = tunable(22.5, unit="deg", meaning="step of the yaws of the hand")
    tip_clearance_m: float = tunable(0.004, unit="m", meaning="least distance of finger tips and table")
    side_clearance_m: float = tunable(0.004, unit="m", meaning="least distance of open fingers and palm to neighbours")
    self_overlap_m: float = tunable(
        0.002, unit="m", meaning="overlap with a finger up to which points of the object itself do not block it"
    )
    palm_clearance_m: float = tunable(0.004, unit="m", meaning="least distance of the palm's front and any point")
    low_rim_m: float = tunable(
        0.028,
        unit="m",
        meaning="height of a rim up to which it is not grasped: its weight would turn it in the fingers",
    )
    rim_inset_m: float = tunable(0.004, unit="m", meaning="distance from the radius of a rim inwards to its grasp")
    finger_clearances_m: tuple[float, ...] = tunable(
        (0.05, 0.04, 0.03, 0.022), unit="m", meaning="how much wider than the object the fingers open, tried in order"
    )
    first_leaning_clearance: int = tunable(
        2, meaning="index of the first of these for a leaning hand, whose lower finger would meet the table"
    )
    open_slack_m: float = tunable(
        0.002, unit="m", meaning="distance that the opening of the fingers keeps from its greatest value"
    )
    opening_margin_m: float = tunable(
        0.006, unit="m", meaning="least difference of the greatest opening and the width of an object"
    )
    upright_wall_rad: float = tunable(0.15, unit="rad", meaning="slope of a wall up to which the hand does not lean")
    max_lean_rad: float = tunable(0.7, unit="rad", meaning="greatest lean of the hand along a wall")
    wall_pitches_deg: tuple[float, float] = tunable(
        (90.0, 75.0), unit="deg", meaning="pitches of hands that lean along a wall"
    )
    few_points: int = tunable(20, meaning="least number of points of a wall whose slope is measured")
    least_wall_height_m: float = tunable(
        0.015, unit="m", meaning="least height of the visible part of a wall whose slope is measured"
    )
    wall_depth_m: float = tunable(0.03, unit="m", meaning="height of the part of a wall, below its rim, for its slope")
    wall_floor_m: float = tunable(
        0.008, unit="m", meaning="height above the floor up to which points are not of a wall"
    )
    wall_radius_share: float = tunable(0.85, meaning="radius of the middle of a wall, as share of that of its rim")
    wall_radius_tolerance: float = tunable(0.2, meaning="greatest difference from that share of a point of the wall")
    low_object_m: float = tunable(0.07, unit="m", meaning="height below which an object is grasped at one level only")
    middle_level: float = tunable(0.5, meaning="that level, as share of the height; long objects are grasped there too")
    body_levels: tuple[float, ...] = tunable(
        (0.35, 0.55, 0.75, 0.88), meaning="levels at which higher objects are grasped, as shares of the height"
    )
    long_object_m: float = tunable(0.09, unit="m", meaning="length above which it is grasped off its middle, too")
    long_shares: tuple[float, ...] = tunable(
        (-0.3, -0.15, 0.15, 0.3), meaning="where long objects are grasped along their length, from the middle"
    )
    least_pad_points: int = tunable(4, meaning="least number of points between the pads of a grasp")
    rim_windows_m: tuple[float, ...] = tunable(
        (0.022, 0.034, 0.044),
        unit="m",
        meaning="half widths about a rim of what the fingers hold, tried in order: the wall of a plate slopes inwards",
    )
    over_rim_m: float = tunable(
        0.036, unit="m", meaning="depth of the tips below a rim, if the floor allows: long contacts bear the weight"
    )
    rim_floor_gap_m: float = tunable(0.003, unit="m", meaning="least distance of the tips and the floor below a rim")
    least_depth_m: float = tunable(0.006, unit="m", meaning="depth of the tips below a rim that a grasp has to exceed")
    half_open_m: float = tunable(
        0.035, unit="m", meaning="distance from the middle to the outside of fingers that are opened a little"
    )
    past_widest_m: float = tunable(0.008, unit="m", meaning="depth of the tips beyond the widest place of an object")
    past_middle_m: float = tunable(0.05, unit="m", meaning="greatest depth of the tips beyond the grasped point")
    least_past_middle_m: float = tunable(0.022, unit="m", meaning="least depth of the tips that is aimed at there")
    hollow_depth_m: float = tunable(
        0.03, unit="m", meaning="depth of the tips beyond the grasped point of a hollow object below the palm"
    )
    palm_gap_m: float = tunable(0.008, unit="m", meaning="least distance of palm and object at the end of the approach")
    widest_share: float = tunable(0.97, meaning="share of the greatest width that counts as the widest place")
    shallow_height_share: float = tunable(
        0.25, meaning="share of the object's height by which the tips may stay short of the grasped point"
    )
    shallow_pad_share: float = tunable(
        0.6, meaning="the same as share of half the pads' width: an oblique pad still holds with its lower half"
    )
    shallow_slack_m: float = tunable(0.003, unit="m", meaning="what is added to the latter")
    retreat_side_m: float = tunable(
        0.01, unit="m", meaning="distance beside the pads up to which points count for the length of the approach"
    )
    retreat_beyond_m: float = tunable(
        0.03, unit="m", meaning="distance of the tips from the object before the approach"
    )
    retreat_range_m: tuple[float, float] = tunable(
        (0.07, 0.14), unit="m", meaning="bounds of the length of the approach"
    )


@dataclass(frozen=True, slots=True)
class PlacePoseOptions:
    """How an object is turned and released at its place."""

    table_margin_m: float = tunable(0.02, unit="m", meaning="least distance of a place from the edge of the table")
    release_gap_m: float = tunable(
        0.002, unit="m", meaning="height of the object's bottom above its support when the fingers open"
    )
    floor_gap_m: float = tunable(0.006, unit="m", meaning="the same above the floor of a hollow object")
    flat_dish_radii: float = tunable(
        1.6, meaning="length of an object, in radii of a shallow dish, below which it is put on the floor of the dish"
    )
    flat_floor_share: float = tunable(0.6, meaning="radius of that floor, as share of the radius of the rim")
    turns_rad: tuple[float, ...] = tunable(
        tuple(np.radians([0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180]).tolist()),
        unit="rad",
        meaning="turns about the vertical that are tried",
    )
    coarse_turns_rad: tuple[float, ...] = tunable(
        tuple(np.radians([0, 60, -60, 120, -120, 180]).tolist()),
        unit="rad",
        meaning="turns about the vertical that a coarse search tries",
    )
    tilts_rad: tuple[float, float, float] = tunable(
        tuple(np.radians([0, 20, 40]).tolist()), unit="rad", meaning="tilts that are tried over an opening"
    )
    leaning_rad: tuple[float, float, float] = tunable(
        tuple(np.radians([40, 30, 50]).tolist()), unit="rad", meaning="tilts of a long object, one end of which goes in"
    )
    least_pitch_rad: float = tunable(
        float(np.radians(34.0)), unit="rad", meaning="pitch of the hand below which a tilt is not tried"
    )
    long_radii: float = tunable(1.9, meaning="length, in radii of the opening, above which an object is long")
    ball_proportions: tuple[float, float] = tunable(
        (0.85, 1.15), meaning="bounds of height over diameter of a round object that counts as a ball"
    )
    least_tolerance_m: float = tunable(
        0.01, unit="m", meaning="tolerance of a place above which one nearer to the robot is tried as well"
    )
    fit_gap_m: float = tunable(0.015, unit="m", meaning="least gap all around between an object and an opening it fits")
    low_end_radii: float = tunable(
        0.4, meaning="distance of the low end of a long object from the centre of the opening, in its radii"
    )
    rim_width_m: float = tunable(
        0.012, unit="m", meaning="distance inside the radius of a rim from which on points pass over the rim"
    )
    rim_gap_m: float = tunable(0.004, unit="m", meaning="least height of such points above the rim")
    finger_gap_m: float = tunable(0.014, unit="m", meaning="least height of the finger tips above a rim")


GRASP_QUALITY = GraspQualityOptions()
GRASP_SAMPLER = GraspSamplerOptions()
PLACE_POSES = PlacePoseOptions()
