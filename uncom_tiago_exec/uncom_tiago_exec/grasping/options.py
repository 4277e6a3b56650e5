# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune grasping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class GraspQualityOptions:
    """How well a grasp holds an object by friction (after Nguyen 1988)."""

    sheet_kg_m2: float = tunable(
        11.0, unit="kg/m^2", meaning="mass of the surface of dishes: 4 to 5 mm of ceramic, 1.5 mm of steel"
    )
    pad_force_n: float = tunable(10.0, unit="N", meaning="force of one pad that is certain")
    contact_depth_m: float = tunable(0.004, unit="m", meaning="points this near to the outermost count as touched")
    pad_end_m: float = tunable(0.01, unit="m", meaning="length of the pads' end, which holds less")
    slip_taper: float = tunable(
        0.7, meaning="widening per length from which an object slips out, whatever it is made of"
    )
    easy_width_m: float = tunable(0.06, unit="m", meaning="width up to which an object is no harder to hold")
    width_error_m: float = tunable(0.003, unit="m", meaning="error of a width as it is seen")


@dataclass(frozen=True, slots=True)
class GraspSamplerOptions:
    """How grasps are sampled."""

    pitches_deg: tuple[float, ...] = tunable(
        (90.0, 75.0, 60.0, 48.0, 36.0), unit="deg", meaning="pitches of the hand, 90 is straight down"
    )
    tip_clearance_m: float = tunable(0.004, unit="m", meaning="least gap between finger tips and table")
    side_clearance_m: float = tunable(0.004, unit="m", meaning="least gap between an open finger and what it passes")
    low_rim_m: float = tunable(
        0.028, unit="m", meaning="a border lower than this leaves the fingers too little to hold the weight beside them"
    )
    finger_rooms_m: tuple[float, ...] = tunable(
        (0.05, 0.04, 0.03, 0.022), unit="m", meaning="room for the fingers beside what they take, widest first"
    )
    upright_wall_rad: float = tunable(0.15, unit="rad", meaning="a wall that slopes less is upright")
    max_lean_rad: float = tunable(0.7, unit="rad", meaning="greatest lean of a hand along a wall")
    wall_pitches_deg: tuple[float, float] = tunable(
        (90.0, 75.0), unit="deg", meaning="pitches of hands that lean along a wall"
    )
    few_points: int = tunable(20, meaning="fewer points tell no slope")
    least_wall_height_m: float = tunable(
        0.015, unit="m", meaning="height that the seen part of a wall must have for its slope to be told"
    )
    wall_radius_share: float = tunable(0.85, meaning="radius of the middle of a wall, as share of its rim's")
    wall_radius_tolerance: float = tunable(0.2, meaning="how far from that share points belong to the wall")
    low_object_m: float = tunable(0.07, unit="m", meaning="height below which an object is taken at one level only")
    long_object_m: float = tunable(0.09, unit="m", meaning="length above which it is taken beside its middle, too")
    least_pad_points: int = tunable(4, meaning="fewer points between the pads are no grasp")
    least_depth_m: float = tunable(
        0.006, unit="m", meaning="depth of the tips below a border, beyond its point, that is no grasp if not exceeded"
    )
    half_open_m: float = tunable(
        0.035, unit="m", meaning="from the middle to the outside of fingers that are opened a little"
    )
    over_rim_m: float = tunable(
        0.036,
        unit="m",
        meaning="how far tips go below a border, if its floor allows: pads so long bear the weight beside them",
    )
    past_widest_m: float = tunable(0.008, unit="m", meaning="how far tips go beyond the widest place between the pads")
    past_middle_m: float = tunable(0.05, unit="m", meaning="how far they go beyond its middle, at most")
    widest_share: float = tunable(0.97, meaning="share of the greatest width that counts as the widest place")


@dataclass(frozen=True, slots=True)
class PlacePoseOptions:
    """How an object is turned and let go at its place."""

    release_gap_m: float = tunable(
        0.002, unit="m", meaning="gap between the object's bottom and its support when the fingers open"
    )
    turns_rad: tuple[float, ...] = tunable(
        tuple(np.radians([0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180]).tolist()),
        unit="rad",
        meaning="turns about the vertical that are tried",
    )
    coarse_turns_rad: tuple[float, ...] = tunable(
        tuple(np.radians([0, 60, -60, 120, -120, 180]).tolist()),
        unit="rad",
        meaning="the same where many tilts are tried",
    )
    tilts_rad: tuple[float, float, float] = tunable(
        tuple(np.radians([0, 20, 40]).tolist()), unit="rad", meaning="tilts that are tried over an opening"
    )
    leaning_rad: tuple[float, float, float] = tunable(
        tuple(np.radians([40, 30, 50]).tolist()),
        unit="rad",
        meaning="tilts of what is as long as the opening that it goes into is wide",
    )
    long_radii: float = tunable(1.9, meaning="radii of the opening from which an object is long")
    ball_proportions: tuple[float, float] = tunable(
        (0.85, 1.15), meaning="height over diameter between which a round object counts as a ball"
    )
    least_room_m: float = tunable(0.01, unit="m", meaning="room beside an object in an opening that is worth using")
    low_end_radii: float = tunable(0.4, meaning="radii from the middle of the opening to the end that goes in")


GRASP_QUALITY = GraspQualityOptions()
GRASP_SAMPLER = GraspSamplerOptions()
PLACE_POSES = PlacePoseOptions()
