# SPDX-License-Identifier: Apache-2.0
"""Numbers of the support: outlines on it, spatial relations, free places and receptacles.

Lengths are in metres; without depth they are scaled by `Surface.units_per_m` to pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """The support plane and the outlines of objects on it."""

    assumed_table_width_m: float = tunable(1.0, unit="m", meaning="width of a table that is seen without depth")
    assumed_image_width_px: float = tunable(640.0, unit="px", meaning="width of the image of an unknown camera")
    min_cloud_points: int = tunable(8, meaning="a cloud or mask with fewer points has no outline of its own")
    max_mask_points: int = tunable(2000, meaning="about so many pixels of a mask make its outline")
    thin_outline_m: float = tunable(0.005, unit="m", meaning="an outline without area grows by this")
    thin_outline_px: float = tunable(1.0, unit="px", meaning="the same without depth")
    min_extent_m: float = tunable(1e-3, unit="m", meaning="least extent of an object in each direction")
    min_level_component: float = tunable(
        1e-3, meaning="length of the optical axis along the table below which the camera looks straight down"
    )


@dataclass(frozen=True, slots=True)
class RelationGoalOptions:
    """Where an object may go for a spatial relation, and what it costs; costs are squares of standard deviations."""

    usual_gap_m: float = tunable(0.05, unit="m", meaning="gap to the reference where none was asked for")
    usual_gap_sigma_m: float = tunable(0.05, unit="m", meaning="spread around the usual gap")
    stated_gap_sigma_m: float = tunable(0.02, unit="m", meaning="spread around a gap that was said in words")
    stated_gap_margin_m: float = tunable(0.05, unit="m", meaning="a stated gap may be exceeded by this")
    side_gap_max_m: float = tunable(0.30, unit="m", meaning='farther away is no longer "left of"')
    next_to_gap_max_m: float = tunable(0.12, unit="m", meaning='farther away is no longer "next to"')
    near_gap_max_m: float = tunable(0.25, unit="m", meaning='farther away is no longer "near"')
    cone_ratio: float = tunable(0.7, meaning="largest offset across a direction for one along it (35 degrees)")
    across_sigma_m: float = tunable(0.04, unit="m", meaning="spread across a direction, and across the line between")
    between_min: float = tunable(0.1, meaning='least share of the way from A to B that is "between A and B"')
    between_max: float = tunable(0.9, meaning='greatest share of the way from A to B that is "between A and B"')
    between_width_ratio: float = tunable(0.3, meaning="largest distance from the line, as a share of its length")
    between_sigma: float = tunable(0.15, meaning="spread around the middle, as a share of the way")


@dataclass(frozen=True, slots=True)
class RelationLikelihoodOptions:
    """How well an object stands in a relation to another one, as a natural log."""

    min_log: float = tunable(-8.0, meaning="log of a relation that does not hold at all")
    side_scale_m: float = tunable(0.02, unit="m", meaning="softness of the border of a side")
    cone_sigma_m: float = tunable(0.08, unit="m", meaning="spread outside the cone of 45 degrees around a direction")
    side_gap_scale_m: float = tunable(0.3, unit="m", meaning="a gap costs one log unit for each of these, at a side")
    inside_sigma_m: float = tunable(0.02, unit="m", meaning="spread of the middle of what is in, on or under it")
    near_scale_m: float = tunable(0.25, unit="m", meaning='spread of the gap that is "near"')
    next_to_scale_m: float = tunable(0.12, unit="m", meaning='spread of the gap that is "next to"')
    between_across_sigma_m: float = tunable(0.08, unit="m", meaning="spread across the line between two objects")
    between_beyond_sigma_m: float = tunable(0.03, unit="m", meaning="spread beyond the ends of that line")
    between_off_middle: float = tunable(2.0, meaning="log lost for each length of the line away from its middle")


@dataclass(frozen=True, slots=True)
class PlaceCostOptions:
    """What a place should be like; costs are squares of standard deviations."""

    pointed_max_m: float = tunable(
        0.25, unit="m", meaning="farther from where a gesture meets the table no place is taken"
    )
    pointed_sigma_m: float = tunable(0.03, unit="m", meaning="spread around the point itself, beside the gesture's own")
    exact_max_m: float = tunable(0.08, unit="m", meaning="farther from an exact place none is taken")
    exact_sigma_m: float = tunable(0.02, unit="m", meaning="spread around an exact place")
    beside_margin_m: float = tunable(
        0.01, unit="m", meaning="a gesture this far outside the reference tells side or distance"
    )
    beside_sigma_m: float = tunable(0.08, unit="m", meaning="spread around such a gesture")
    elsewhere_m: float = tunable(0.2, unit="m", meaning='"on the table" is best this far from where the object is')
    elsewhere_sigma_m: float = tunable(0.1, unit="m", meaning="spread around that distance")
    elsewhere_min_share: float = tunable(0.5, meaning="at least this share of that distance is kept")
    easy_reach_m: float = tunable(0.6, unit="m", meaning='"on the table" costs nothing this near to a shoulder')
    easy_reach_sigma_m: float = tunable(0.1, unit="m", meaning="spread beyond that")
    area_sigma_m: float = tunable(0.08, unit="m", meaning="spread around the middle of a named part of the table")
    corner_share: float = tunable(0.8, meaning="a corner's place on the way from the middle to the corner")
    side_share: float = tunable(0.6, meaning="a side's place on the way from the middle to the edge")
    side_selection: float = tunable(
        0.3, meaning="parts lie on a side whose place along it is more than this share of the farthest"
    )


@dataclass(frozen=True, slots=True)
class PlaceSearchOptions:
    """The search for a free place."""

    max_candidates: int = tunable(40, meaning="cells that are told as candidates")
    circle_sides: int = tunable(16, meaning="corners of the circle around an outline")
    easy_reach_share: float = tunable(0.85, meaning="share of the reach up to which places cost nothing")
    far_reach_sigma_m: float = tunable(
        0.05, unit="m", meaning="spread beyond that: near its limit an arm is stretched and may not find a path"
    )
    inner_shares: tuple[float, ...] = tunable(
        (0.5, 0.95), meaning="points of a part of a cell that are weighed, on the way from its middle to its corners"
    )
    refinement_steps: int = tunable(13, meaning="points along each side of the fine grid in the chosen cell")


@dataclass(frozen=True, slots=True)
class VoronoiOptions:
    """The seeds of the occupancy map."""

    max_seeds: int = tunable(900, meaning="cells grow so that there are about at most so many")
    relaxations: int = tunable(4, meaning="rounds of Lloyd's algorithm")
    jitter: float = tunable(0.2, meaning="largest offset of a seed from its grid, as a share of the cell size")
    ring_divisor: float = tunable(3.0, meaning="seeds around an object lie a cell size divided by this away from it")
    ring_spacing: float = tunable(0.6, meaning="distance of the seeds around an object, in cell sizes")
    ring_min_seeds: int = tunable(6, meaning="seeds around an object at least")
    clear_share: float = tunable(0.5, meaning="no other seeds nearer to those around objects, in cell sizes")
    span_factor: float = tunable(10.0, meaning="distance of the helper seeds outside, in widths of the table")


@dataclass(frozen=True, slots=True)
class ReceptacleOptions:
    """The opening or top of a receiving object, from its points."""

    raster_m: float = tunable(0.005, unit="m", meaning="size of a pixel of the view from above")
    closing_rounds: int = tunable(3, meaning="rounds of closing gaps in the view from above")
    disc_share: float = tunable(0.95, meaning="places whose free radius is this share of the largest are its middle")
    near_share: float = tunable(0.5, meaning="the height in the opening is that of points within this share of it")
    near_pixels: float = tunable(2.0, meaning="but within so many pixels of the view at least")
    rim_percentile: float = tunable(95.0, meaning="percentile of the heights of all points that is the rim")
    fit_factor: float = tunable(1.5, meaning="an object this many times as wide as the opening still goes in")
    fit_margin_m: float = tunable(0.01, unit="m", meaning="and so much more, for errors of sight")
    min_radius: float = tunable(1e-3, meaning="least radius of an opening [plane units]")


SURFACE = SurfaceOptions()
RELATION_GOAL = RelationGoalOptions()
RELATION_LIKELIHOOD = RelationLikelihoodOptions()
PLACE_COST = PlaceCostOptions()
PLACE_SEARCH = PlaceSearchOptions()
VORONOI = VoronoiOptions()
RECEPTACLE = ReceptacleOptions()
