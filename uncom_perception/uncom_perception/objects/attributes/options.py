# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune attributes."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ColourNamingOptions:
    """How pixels get the names of colours: by distance to exemplars in CIELAB."""

    lightness_weight: float = tunable(0.55, meaning="weight of a difference in lightness beside one in a or b")
    sigma: float = tunable(9.0, unit="Lab", meaning="spread of a colour name around its nearest exemplar")
    bins: int = tunable(32, meaning="cells a side of the look-up table over RGB")
    chroma_step: float = tunable(
        0.16, meaning="width of the cells of relative chroma by which pixels of one paint are grouped"
    )
    deepest_shade: float = tunable(
        1.7, meaning="most by which a shaded pixel of one paint is brightened before it is named"
    )


@dataclass(frozen=True, slots=True)
class NounLikelihoodOptions:
    """How the measures of an object count for a noun."""

    least_fit: float = tunable(
        0.02, meaning="least likelihood of a measure far outside a noun's range: it may be hidden"
    )
    unusual_colour: float = tunable(0.06, meaning="how usual a colour is that a noun's entry does not name")
    least_colour_mass: float = tunable(
        0.25, meaning="least share of all colours that a noun's colours are taken to cover"
    )
    least_range_mass: float = tunable(
        0.15, meaning="least share of all objects that a range of a measure is taken to cover"
    )


@dataclass(frozen=True, slots=True)
class ObjectGeometryOptions:
    """How the points of one object are cleaned before they are measured."""

    voxel_m: float = tunable(0.004, unit="m", meaning="edge of the cells that keep one point each")
    crowd_cell_m: float = tunable(0.012, unit="m", meaning="edge of the cells in which a point needs neighbours")
    max_points: int = tunable(6000, meaning="pixels of an object that are looked at, at most")
    piece_gap_m: float = tunable(
        0.015, unit="m", meaning="points farther apart than this, seen from above, belong to different pieces"
    )
    stray_share: float = tunable(0.03, meaning="pieces with a smaller share of the points are dropped")
    tall_m: float = tunable(
        0.04,
        unit="m",
        meaning="least height of an object that may have smeared trails: of lower ones much lies near the table",
    )
    trail_height_m: float = tunable(0.016, unit="m", meaning="height up to which smeared pixels trail on the table")
    trail_height_share: float = tunable(0.1, meaning="the same as a share of the object's height")
    trail_reach_m: float = tunable(
        0.012, unit="m", meaning="how far outside the outline of what is higher a trail lies at least"
    )
    lowest_m: float = tunable(-0.01, unit="m", meaning="lower points are not of an object")
    few_points: int = tunable(30, meaning="with fewer points nothing is cleaned")
    least_crowd: int = tunable(3, meaning="points of a cell from which none of them is alone")


@dataclass(frozen=True, slots=True)
class PhraseMatchOptions:
    """How a phrase is matched with an object."""

    sure_description: float = tunable(0.6, meaning="fit of a user's own description above which it names the object")
    description_trust: float = tunable(0.9, meaning="probability given to a perfect fit of a user's own description")
    kind_trust: float = tunable(0.4, meaning="probability given to a noun by what its class fits")
    plain_fit: float = tunable(
        0.25, meaning="fit from which an object is plainly called so: then words are not taken loosely"
    )
    unknown_noun_fit: float = tunable(
        0.3, meaning="fit of every object for a noun that the lexicon does not know: weak, the same for all"
    )


@dataclass(frozen=True, slots=True)
class AttributeOptions:
    """Which attributes of an object are told."""

    least_colour_share: float = tunable(0.12, meaning="least share of a colour among an object's pixels to be told")
    longest_table_phrase: int = tunable(3, meaning="words of the longest phrase that may mean the table itself")


@dataclass(frozen=True, slots=True)
class ShapeOptions:
    """How the shape of an object is measured."""

    cell_m: float = tunable(0.003, unit="m", meaning="edge of the cells of the footprint")
    sectors: int = tunable(16, meaning="sectors around the middle in which the rim is looked for")
    max_points: int = tunable(1500, meaning="points that suffice to see how an object is bent, and its widths")
    slices: int = tunable(9, meaning="slices along an object, to see how it is bent")
    least_handle_cells: int = tunable(6, meaning="cells of a piece beside the body that may be a handle")
    least_cavity_radius_m: float = tunable(0.015, unit="m", meaning="mean radius below which nothing is hollow")
    rim_from: float = tunable(0.7, meaning="share of the radius outside which the rim is looked for")
    middle_to: float = tunable(0.6, meaning="share of the radius inside which the floor is looked for")
    least_middle_points: int = tunable(5, meaning="points in the middle that a cavity needs")
    inner_to: float = tunable(0.9, meaning="share of the radius inside which depth is measured")
    least_hollowness: float = tunable(0.1, meaning="hollowness below which there is no depth of a cavity")
    least_length_m: float = tunable(1e-3, unit="m", meaning="shorter objects are not bent")
    least_slices: int = tunable(5, meaning="slices with points that a curvature needs")
    least_band_points: int = tunable(5, meaning="points of a band of heights that have a width")
    least_width_m: float = tunable(0.004, unit="m", meaning="smaller widths are not compared")


COLOUR_NAMING = ColourNamingOptions()
NOUN_LIKELIHOOD = NounLikelihoodOptions()
OBJECT_GEOMETRY = ObjectGeometryOptions()
PHRASE_MATCH = PhraseMatchOptions()
ATTRIBUTES = AttributeOptions()
SHAPE = ShapeOptions()
