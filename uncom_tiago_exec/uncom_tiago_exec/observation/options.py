# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune what is made of what is seen: verification, finding objects again, and the robot itself."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class VerificationOptions:
    """When a task counts as done, and what is told of the other objects."""

    place_tolerance_m: float = tunable(
        0.06, unit="m", meaning="distance from its expected place up to which an object is at it"
    )
    moved_m: float = tunable(0.02, unit="m", meaning="distance up to which another object has not been moved")
    search_radius_m: float = tunable(
        0.10, unit="m", meaning="distance from its old place up to which another object is looked for"
    )
    same_place_m: float = tunable(
        0.02, unit="m", meaning="distance up to which something stands at the object's old place"
    )
    same_extent_ratios: tuple[float, float] = tunable(
        (0.6, 1.6), meaning="ratios of visible extents between which something there is the object itself"
    )
    least_motion_m: float = tunable(
        0.04, unit="m", meaning="planned distance up to which an object seen at its old place may be at its new one"
    )
    whole_extent_ratio: float = tunable(
        0.85, meaning="ratio of two visible extents of one object from which on an arm hides a part of it in neither"
    )
    rise_m: float = tunable(0.01, unit="m", meaning="least thickness of what lies in an opening now")
    opening_radius_ratio: float = tunable(
        0.6, meaning="share of the radius of an opening within which heights are compared"
    )
    opening_quantile: float = tunable(0.95, meaning="quantile of the heights in an opening that counts as their top")
    opening_points: int = tunable(5, meaning="points in an opening up to which nothing is seen of its inside")
    bottom_quantile: float = tunable(0.02, meaning="quantile of the heights of an object that counts as its bottom")
    top_quantile: float = tunable(0.98, meaning="quantile of the heights at a place that counts as their top")
    target_margin_m: float = tunable(
        0.01, unit="m", meaning="distance around an object's radius within which it is looked for on its target"
    )
    on_target_height_ratio: float = tunable(
        0.4, meaning="share of its height by which an object rises over the target that it stands on"
    )
    tall_ratio: float = tunable(1.5, meaning="height as a multiple of the width from which on an object may fall over")
    fallen_margin_m: float = tunable(
        0.02, unit="m", meaning="distance around an object's radius within which it is looked for as fallen over"
    )
    fallen_points_ratio: float = tunable(
        0.2, meaning="share of the points seen of an object before that must be seen to tell that it has fallen over"
    )
    fallen_height_ratio: float = tunable(
        0.35, meaning="share of its height by which what has fallen over is lower than it stood"
    )
    cell_m: float = tunable(0.01, unit="m", meaning="cell of the height map of an object seen from above")
    cell_distance_ratio: float = tunable(
        1.5, meaning="distance in cells up to which a point is seen at a cell of the height map"
    )
    upper_side_ratio: float = tunable(
        0.5,
        meaning="share of an object's upper side that must be seen where it was to be, if it is seen as one with "
        "what it stands beside",
    )
    told_error_m: float = tunable(9.9, unit="m", meaning="greatest distance that is told")


@dataclass(frozen=True, slots=True)
class ReidentificationOptions:
    """When a detection of a new picture is an object of an earlier one."""

    search_radius_m: float = tunable(
        0.12, unit="m", meaning="distance from its last place up to which an object is the nearest one seen"
    )
    still_m: float = tunable(0.03, unit="m", meaning="distance up to which another object has not moved")
    extent_misfit: float = tunable(0.5, meaning="logarithm of the ratio of two visible extents of one object at most")
    same_object_m: float = tunable(0.05, unit="m", meaning="distance between two detections of one object at most")
    whole_extent_ratio: float = tunable(
        0.9, meaning="share of its visible extent from which on nothing of an object is hidden"
    )
    table_height_m: float = tunable(0.03, unit="m", meaning="difference between two heights of one table at most")


@dataclass(frozen=True, slots=True)
class RobotSegmentationOptions:
    """What of a picture is the robot itself."""

    margin_m: float = tunable(
        0.025,
        unit="m",
        meaning="distance around a link's box within which points are the robot's: errors of depth",
    )
    own_points_ratio: float = tunable(
        0.5, meaning="share of its points in the robot's boxes from which on a detection is the robot's"
    )


VERIFICATION = VerificationOptions()
REIDENTIFICATION = ReidentificationOptions()
ROBOT_SEGMENTATION = RobotSegmentationOptions()
