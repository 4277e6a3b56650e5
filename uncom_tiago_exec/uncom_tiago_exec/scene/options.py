# SPDX-License-Identifier: Apache-2.0
"""What tunes the scene: how shapes are completed, which solids hold them, and what is taken to be hidden."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class CircleFittingOptions:
    """How a circle is fitted robustly."""

    least_points: int = tunable(8, meaning="points below which there is no circle")
    triples: int = tunable(120, meaning="circles through three random points that are tried")
    voters: int = tunable(200, meaning="points that vote for a circle, about")
    sectors: int = tunable(24, meaning="directions in which coverage is counted")


@dataclass(frozen=True, slots=True)
class RimOptions:
    """When a round edge with something lower inside is an opening."""

    least_height_m: float = tunable(0.008, unit="m", meaning="height below which an object has no opening")
    least_points: int = tunable(40, meaning="points below which no opening is looked for")
    band_share: float = tunable(0.3, meaning="height of the edge as a share of the object's height")
    least_band_m: float = tunable(0.005, unit="m", meaning="least height of the edge")
    most_band_m: float = tunable(0.012, unit="m", meaning="greatest height of the edge")
    tolerance_m: float = tunable(0.005, unit="m", meaning="from the circle that points of the edge may be")
    radius_range_m: tuple[float, float] = tunable((0.02, 0.2), unit="m", meaning="least and greatest radius")
    least_coverage: float = tunable(0.7, meaning="share of directions in which the edge must be seen")
    inside_share: float = tunable(0.7, meaning="share of the radius that is certainly inside the edge")
    drop_share: float = tunable(0.35, meaning="depth under the edge that counts as lower, as a share of the height")
    least_drop_m: float = tunable(0.004, unit="m", meaning="least depth that counts as lower")
    most_drop_m: float = tunable(0.015, unit="m", meaning="greatest depth that is needed to count as lower")
    point_side_m: float = tunable(0.004, unit="m", meaning="side of the square that one point stands for")
    seen_inside: float = tunable(0.05, meaning="share of the inside that must be seen to tell anything")
    least_low_share: float = tunable(0.75, meaning="share of the points inside that must be lower")
    edge_width_m: float = tunable(0.008, unit="m", meaning="from the circle that points belong to the edge")
    outer_quantile: float = tunable(0.9, meaning="quantile of the distances of the edge that is the outer radius")
    floor_inside_share: float = tunable(0.6, meaning="share of the radius in which the floor is looked for")
    floor_quantile: float = tunable(0.05, meaning="quantile of the heights inside that is the floor")
    least_floor_points: int = tunable(5, meaning="points inside that are too few to tell the floor")
    unseen_floor_m: float = tunable(0.006, unit="m", meaning="height of a floor that is not seen")
    edge_quantile: float = tunable(0.9, meaning="quantile of the heights at the edge that is the edge's height")
    least_depth_m: float = tunable(0.005, unit="m", meaning="depth of the shallowest opening")


@dataclass(frozen=True, slots=True)
class RoundOptions:
    """When the footprint of an upright object is a circle."""

    outline_step_m: float = tunable(0.003, unit="m", meaning="between points along the convex outline")
    tolerance_m: float = tunable(0.003, unit="m", meaning="from the circle that points of the outline may be")
    radius_range_m: tuple[float, float] = tunable((0.015, 0.12), unit="m", meaning="least and greatest radius")
    least_coverage: float = tunable(0.6, meaning="share of directions in which the outline must be on the circle")
    beyond_m: float = tunable(0.012, unit="m", meaning="by which the object may be longer than the circle")
    most_elongation: float = tunable(1.15, meaning="ratio of the outline's greatest to its least spread")
    ball_error_m: float = tunable(0.0025, unit="m", meaning="mean distance from a ball's surface")
    ball_radius_range_m: tuple[float, float] = tunable((0.015, 0.07), unit="m", meaning="radii of balls")
    ball_above_m: float = tunable(0.012, unit="m", meaning="by which a ball may seem to hang or to sink in the table")


@dataclass(frozen=True, slots=True)
class ShapeCompletionOptions:
    """How the unseen side of an object is filled in."""

    voxel_m: float = tunable(0.004, unit="m", meaning="side of the cubes that hold one point each")
    least_points: int = tunable(12, meaning="points below which the detection's box is taken instead")
    least_height_m: float = tunable(0.003, unit="m", meaning="height of the flattest object")
    top_quantile: float = tunable(0.995, meaning="quantile of the heights that is the top")
    least_size_m: float = tunable(0.004, unit="m", meaning="side of the smallest box")
    below_table_m: float = tunable(0.01, unit="m", meaning="under the table that points are dropped")
    most_height_m: float = tunable(0.6, unit="m", meaning="over the table that points are dropped")
    least_clean_points: int = tunable(30, meaning="points below which no lone ones are dropped")
    clean_quantiles: tuple[float, float] = tunable((0.01, 0.99), meaning="quantiles between which the rest lies")
    clean_share: float = tunable(0.25, meaning="share of that span beyond which a point is alone")
    clean_slack_m: float = tunable(0.006, unit="m", meaning="distance beyond it that is allowed as well")
    uneven_m: float = tunable(0.002, unit="m", meaning="beyond the radius of its footprint of anything round")
    bulge_m: float = tunable(0.006, unit="m", meaning="beyond the radius of its footprint of a belly")
    belly_sectors: int = tunable(24, meaning="directions in which a belly is told from a handle")
    belly_level_m: float = tunable(0.012, unit="m", meaning="heights in which a belly is told from a handle")
    least_belly_sectors: int = tunable(5, meaning="directions in which a belly is seen at least")
    widest_m: float = tunable(0.008, unit="m", meaning="from the widest place of a profile that still is the widest")
    underside_step_m: float = tunable(0.006, unit="m", meaning="between points straight down from the widest place")
    turns: int = tunable(48, meaning="directions in which a profile is turned about its axis")
    most_layers: int = tunable(16, meaning="heights of a wall under what is seen, at most")
    layer_m: float = tunable(0.008, unit="m", meaning="between two heights of the wall")
    lowest_layer_m: float = tunable(0.002, unit="m", meaning="of the bottom over the table")
    above_layer_m: float = tunable(0.004, unit="m", meaning="that something is higher than a layer it stands over")


@dataclass(frozen=True, slots=True)
class SolidOptions:
    """The boxes and cylinders that hold objects and the table."""

    pad_m: float = tunable(0.003, unit="m", meaning="added all around, for what the camera gets wrong")
    held_pad_m: float = tunable(0.001, unit="m", meaning="added all around what is in the hand")
    table_thickness_m: float = tunable(0.08, unit="m", meaning="of the table top")
    table_border_m: float = tunable(0.03, unit="m", meaning="by which the table is wider than seen")
    body_beyond_m: float = tunable(0.006, unit="m", meaning="beyond the radius that still is body, not handle")
    least_rest_points: int = tunable(4, meaning="points beside the round body below which they hold no solid")
    shallow_m: float = tunable(0.035, unit="m", meaning="depth below which a dish is put on, not into")
    ring_boxes: int = tunable(12, meaning="boxes that make the border of a dish")
    border_from: float = tunable(0.3, meaning="share of a dish's depth over its floor where its border begins")
    least_border_points: int = tunable(8, meaning="points that are too few to tell how wide the border is")
    unseen_inner: float = tunable(0.8, meaning="inner radius of a border that is not seen, as a share of the outer one")
    least_inner: float = tunable(0.4, meaning="least inner radius, as a share of the outer one")
    least_border_m: float = tunable(0.01, unit="m", meaning="width of the thinnest border")
    least_floor_m: float = tunable(0.004, unit="m", meaning="thickness of the thinnest floor")
    outer_quantile: float = tunable(0.98, meaning="quantile of the distances that is the outer radius")
    inner_quantile: float = tunable(0.05, meaning="quantile of the border's distances that is the inner radius")
    tall_m: float = tunable(0.08, unit="m", meaning="height over which a round body is held by three discs, not one")
    tall_discs: int = tunable(3, meaning="discs of a tall round body")
    disc_overlap_m: float = tunable(0.005, unit="m", meaning="beyond a disc where points still count for it")
    like_radius_m: float = tunable(0.012, unit="m", meaning="difference of radii below which two discs become one")
    empty_disc_m: float = tunable(0.01, unit="m", meaning="radius of a disc in which nothing is seen")
    splits: int = tunable(2, meaning="times that a box may be halved")
    least_split_points: int = tunable(40, meaning="points that are too few to halve a box")
    least_half_points: int = tunable(10, meaning="points that are too few for a half")
    split_below: float = tunable(0.75, meaning="volume of both halves below which they are taken, as a share")
    least_height_m: float = tunable(0.002, unit="m", meaning="height of the flattest solid")
    held_clearance_m: float = tunable(0.002, unit="m", meaning="by which a held bottom is raised off the table")


@dataclass(frozen=True, slots=True)
class ShadowOptions:
    """The space behind objects that the camera does not see."""

    tall_m: float = tunable(0.07, unit="m", meaning="height below which an object hides hardly anything")
    hidden_height_m: float = tunable(0.03, unit="m", meaning="what is lower is not expected to stand anywhere")
    longest_m: float = tunable(0.25, unit="m", meaning="length of the longest shadow")
    boxes: int = tunable(2, meaning="boxes that a shadow is made of, the farther the lower")
    own_space_m: float = tunable(0.06, unit="m", meaning="around what the hand is to take or to leave, without shadow")


@dataclass(frozen=True, slots=True)
class SceneMatchingOptions:
    """When two detections of one scene are one object."""

    same_place_m: float = tunable(0.012, unit="m", meaning="distance of the centroids, whatever the names")
    same_name_m: float = tunable(0.05, unit="m", meaning="distance of the centroids of two with one name")


CIRCLE_FITTING = CircleFittingOptions()
RIM = RimOptions()
ROUND = RoundOptions()
SHAPE_COMPLETION = ShapeCompletionOptions()
SOLIDS = SolidOptions()
SHADOWS = ShadowOptions()
SCENE_MATCHING = SceneMatchingOptions()
