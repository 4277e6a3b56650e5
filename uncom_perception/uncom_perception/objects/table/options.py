# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class DepthNoiseOptions:
    """How the noise and the bow of a depth image are measured on the table."""

    bands: int = tunable(6, meaning="bands of distance in which noise is measured")
    most_noise_m: float = tunable(0.012, unit="m", meaning="greatest noise that is believed")
    noise_factor: float = tunable(4.0, meaning="standard deviations over the table from which a pixel is not table")
    least_bow_m: float = tunable(0.0012, unit="m", meaning="a smaller bow is not worth its correction")
    fit_reach_m: float = tunable(0.02, unit="m", meaning="how far from the fitted bow pixels count at first")
    far_off_m: float = tunable(
        0.05, unit="m", meaning="how far from the plane pixels count at all; a greater bow is none"
    )
    least_gain: float = tunable(
        0.7, meaning="remaining share of the spread on what surely is table above which the camera has no bow"
    )
    bow_stride: int = tunable(8, unit="px", meaning="every so manieth pixel is used for the bow")
    noise_stride: int = tunable(4, unit="px", meaning="every so manieth pixel is used for the noise")
    least_pixels: int = tunable(200, unit="px", meaning="pixels of the table that noise is measured on")
    least_band_pixels: int = tunable(30, unit="px", meaning="pixels of a band of distance")
    least_fit_pixels: int = tunable(120, unit="px", meaning="pixels that a bow is fitted to")


@dataclass(frozen=True, slots=True)
class DepthCleaningOptions:
    """Which depth pixels are mended or dropped."""

    steepest: float = tunable(
        4.5, meaning="tangent of the angle between line of sight and normal up to which surfaces are seen (77 degrees)"
    )
    surrounded: int = tunable(
        5, meaning="known neighbours of eight from which a pixel is a pinhole: at the edge of a shadow there are three"
    )
    many_share: float = tunable(0.01, meaning="share of the picture below which pinholes do no harm")
    least_known: int = tunable(3, meaning="known neighbours of eight that fill a pixel")
    rounds: int = tunable(3, meaning="rounds of filling")
    agree: float = tunable(0.02, meaning="share of the depth beyond which neighbours are of two surfaces")


@dataclass(frozen=True, slots=True)
class TableOutlineOptions:
    """How the outline of the table top is found."""

    cell_m: float = tunable(0.005, unit="m", meaning="edge of the cells of the map of distances to the table")
    seen_through_share: float = tunable(
        0.01, meaning="share of pixels below the plane from which a hull is no table top"
    )
    outside_share: float = tunable(
        0.35, meaning="share of a hull outside the known table from which it is contradicted"
    )
    below_m: float = tunable(-0.03, unit="m", meaning="height below which pixels are seen through the plane")
    least_distance_m: float = tunable(
        0.05, unit="m", meaning="distance from the camera below which an outline is cut off"
    )


@dataclass(frozen=True, slots=True)
class TablePlaneOptions:
    """How the plane of the table is found (RANSAC, then least squares)."""

    sample: int = tunable(900, meaning="points that RANSAC draws from")
    refining: int = tunable(4000, meaning="points that the plane is refined with")
    inlier_m: float = tunable(0.008, unit="m", meaning="distance from the plane up to which a point is an inlier")
    storey_m: float = tunable(
        0.2, unit="m", meaning="level planes farther apart than this are a table and the floor, or a seat"
    )
    floor_share: float = tunable(0.12, meaning="share of the floor's pixels that a table must have at least")
    layer_m: float = tunable(
        0.016, unit="m", meaning="distance from the plane within which its lowest layer is looked for"
    )
    layer_bin_m: float = tunable(0.0005, unit="m", meaning="bins of that search")
    least_share: float = tunable(0.04, meaning="share of the sampled points that a plane needs")
    least_table_z_m: float = tunable(
        0.25, unit="m", meaning="least height of a table over the floor, where the base frame is known"
    )
    greatest_table_z_m: float = tunable(
        1.4, unit="m", meaning="greatest height of a table over the floor, where the base frame is known"
    )
    least_up_in_base: float = tunable(
        np.cos(np.radians(8.0)), meaning="cosine of the greatest tilt (8 degrees) where gravity is known"
    )
    least_up_in_camera: float = tunable(
        np.cos(np.radians(85.0)), meaning="cosine of the greatest tilt against the camera (85 degrees) where it is not"
    )
    settled_rad: float = tunable(
        0.0001,
        unit="rad",
        meaning="a round of the fit that turns, or shifts [m], the plane by less is the last (0.1 mm at its end)",
    )
    least_points: int = tunable(200, meaning="known points that a picture needs")
    least_inliers: int = tunable(30, meaning="inliers that a plane needs")
    few_points: int = tunable(20, meaning="fewer points are not fitted")
    fine_layer_m: float = tunable(
        0.0008, unit="m", meaning="distance from the layer within which its height is measured, finer than the bins"
    )
    least_below: int = tunable(10, meaning="points below the layer that tell its noise")
    least_area_m2: float = tunable(
        1e-4, unit="m^2", meaning="area below which three points lie on a line, or too near one another"
    )


@dataclass(frozen=True, slots=True)
class TableViewOptions:
    """What of an image is looked at, given the table."""

    stride: int = tunable(4, unit="px", meaning="every so manieth pixel decides the window")
    below_m: float = tunable(0.01, unit="m", meaning="how far below the table is looked")
    highest_m: float = tunable(0.65, unit="m", meaning="how high over the table is looked")


DEPTH_NOISE = DepthNoiseOptions()
DEPTH_CLEANING = DepthCleaningOptions()
TABLE_OUTLINE = TableOutlineOptions()
TABLE_PLANE = TablePlaneOptions()
TABLE_VIEW = TableViewOptions()
