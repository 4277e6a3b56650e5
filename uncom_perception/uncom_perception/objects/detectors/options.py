# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune detectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class DetectionReportOptions:
    """What is told of the objects of one image."""

    least_fit: float = tunable(0.1, meaning="least probability of a phrase for an object to be listed")


@dataclass(frozen=True, slots=True)
class GroundingDinoFilterOptions:
    """Which boxes of GroundingDINO are no objects."""

    max_hand_share: float = tunable(
        0.4, meaning="share of a box covered by a pointing hand above which it is that hand"
    )
    least_side_px: float = tunable(2.0, unit="px", meaning="smaller boxes are none")
    table_overlap: float = tunable(0.8, meaning="overlap with the table from which a box is the table")
    least_points: int = tunable(20, meaning="points in space that a geometry needs")
    least_inner_pixels: int = tunable(
        30, unit="px", meaning="pixels away from the mask's border that suffice to name its colour"
    )


@dataclass(frozen=True, slots=True)
class PictureDetectorOptions:
    """How a table and objects are found by colour alone."""

    trust: float = tunable(0.5, meaning="factor on all probabilities where there is no depth")
    chroma_limit: float = tunable(
        9.0, unit="Lab", meaning="pixels this near to the table's colour in a and b are table"
    )
    lighter_limit: float = tunable(14.0, unit="Lab", meaning="how much lighter than its surroundings the table may be")
    darker_limit: float = tunable(
        34.0, unit="Lab", meaning="how much darker it may be: shadows darken it without changing its hue much"
    )
    work_width_px: int = tunable(640, unit="px", meaning="width to which wider pictures are scaled")
    fit_stride: int = tunable(6, unit="px", meaning="every so manieth pixel is used to fit the table's colour")
    leg_gap_share: float = tunable(
        0.35, meaning="share of the width of what has the table's colour: a narrower gap is no gap between its legs"
    )
    max_table_pieces: int = tunable(6, meaning="pieces of the table that objects part, at most")
    least_table_piece: float = tunable(
        0.004, meaning="share of the picture below which a piece is no part of the table"
    )
    line_error_px: float = tunable(2.5, unit="px", meaning="distance up to which a point votes for a line")
    steepest_line: float = tunable(0.5, meaning="slope of the steepest line that may be the table's front edge")
    least_fit_pixels: int = tunable(200, unit="px", meaning="pixels that a fit of the table's colour needs")


@dataclass(frozen=True, slots=True)
class PicturePieceOptions:
    """Which pieces of what is not table are objects."""

    least_area_share: float = tunable(0.0006, meaning="least share of the picture")
    most_area_share: float = tunable(0.25, meaning="greatest share of the picture")
    edge_px: int = tunable(
        7, unit="px", meaning="distance from the outline of table or picture within which there is hardly an object"
    )
    thin_px: float = tunable(16.0, unit="px", meaning="thinner pieces must be solid")
    colourful: float = tunable(20.0, unit="Lab", meaning="chroma from which a hue says something")
    other_hue_rad: float = tunable(
        np.radians(30.0), unit="rad", meaning="hues farther apart than this are of different objects"
    )
    inner_object_share: float = tunable(0.2, meaning="share of a piece that another object in it covers at least")
    connected_share: float = tunable(
        0.75, meaning="share of the pixels of a hue that hang together if they are an object"
    )
    beyond_edge_heights: float = tunable(
        1.6, meaning="heights of what is seen by which an object may go on beyond the table's edge"
    )
    least_crossing_px: int = tunable(
        8, unit="px", meaning="width of the border over which an object goes on beyond the table"
    )


@dataclass(frozen=True, slots=True)
class TabletopDetectorOptions:
    """How far measures of an object are trusted."""

    hidden_on_other: float = tunable(
        0.6, meaning="least share taken to be hidden of an object that stands in or on another"
    )
    sure_pixels: int = tunable(300, unit="px", meaning="pixels of an object from which its score is 1")
    max_blur: float = tunable(0.5, meaning="greatest share taken to be hidden because the depth is noisy")
    max_colour_pixels: int = tunable(1000, unit="px", meaning="pixels that colours are named by, at most")
    least_points: int = tunable(20, meaning="points in space of an object")
    least_inner_pixels: int = tunable(
        30, unit="px", meaning="pixels away from the mask's border that suffice to name its colour"
    )


DETECTION_REPORT = DetectionReportOptions()
GROUNDING_DINO_FILTER = GroundingDinoFilterOptions()
PICTURE_DETECTOR = PictureDetectorOptions()
PICTURE_PIECES = PicturePieceOptions()
TABLETOP_DETECTOR = TabletopDetectorOptions()
