# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune segments."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ColourFillOptions:
    """How holes of a mask are filled by colour."""

    bin_widths: tuple[float, float, float] = tunable(
        (10.0, 7.0, 7.0), unit="Lab", meaning="widths of histogram cells of lightness, a and b"
    )
    black_cell: tuple[float, float, float] = tunable((0.0, 20.0, 20.0), meaning="indices of the cell of black")
    bins: tuple[int, int, int] = tunable((12, 40, 40), meaning="number of cells of lightness, a and b")
    least_gap_share: float = tunable(0.06, meaning="share of the mask's area below which a hole is not filled")
    ring_px: int = tunable(13, unit="px", meaning="width of the ring around an object whose colours are the table's")
    likelihood_ratio: float = tunable(3.0, meaning="how much likelier than the table's the colour of a part has to be")
    least_ring_px: int = tunable(50, unit="px", meaning="pixels of the ring that the table's colours are taken from")
    least_inner_px: int = tunable(
        50, unit="px", meaning="pixels away from the mask's border that suffice for its colours"
    )


@dataclass(frozen=True, slots=True)
class ForegroundOptions:
    """What stands out from the table, and where surfaces end."""

    gap_m: float = tunable(
        0.012,
        unit="m",
        meaning="neighbouring pixels farther apart than this (or 6 pixel widths) belong to different surfaces",
    )
    max_height_m: float = tunable(0.6, unit="m", meaning="greatest height over the table that is looked at")
    least_height_m: float = tunable(
        0.0022, unit="m", meaning="least height over the table of an object's pixels, noise apart"
    )


@dataclass(frozen=True, slots=True)
class ArmMaskOptions:
    """How hands and forearms are followed by their colour."""

    least_sample_px: int = tunable(20, unit="px", meaning="pixels of a hand that its colour is taken from")


@dataclass(frozen=True, slots=True)
class CavityOptions:
    """When a surface is the inside of a hollow object."""

    least_width_m: float = tunable(0.03, unit="m", meaning="least width of an opening")
    greatest_width_m: float = tunable(0.32, unit="m", meaning="greatest width of an opening")
    upper_share: float = tunable(0.4, meaning="share of the inside, from the top, that is its wall below the rim")
    upper_m: float = tunable(0.012, unit="m", meaning="the same as a height")
    least_sag: float = tunable(
        0.13, meaning="share of its width by which the middle of the back wall is farther away than its ends, at least"
    )
    greatest_sag: float = tunable(0.8, meaning="the same, at most")
    wider_factor: float = tunable(1.15, meaning="how much wider than the front rim the inside may be")
    wider_m: float = tunable(0.008, unit="m", meaning="what is added to that")
    deeper_factor: float = tunable(1.5, meaning="how much deeper than wide the inside may be")
    deeper_m: float = tunable(0.02, unit="m", meaning="what is added to that")
    nearer_share: float = tunable(0.85, meaning="share of the front that must be nearer than the middle of the inside")


@dataclass(frozen=True, slots=True)
class FragmentJoinOptions:
    """When fragments are parts of one object."""

    cell_m: float = tunable(0.005, unit="m", meaning="edge of the cells seen from above in which fragments meet")
    border_pixels: int = tunable(12, unit="px", meaning="pixels of common border from which fragments meet")
    same_level_m: float = tunable(
        0.03, unit="m", meaning="difference of height below which cells are level with one another"
    )
    handle_gap_m: float = tunable(0.02, unit="m", meaning="greatest gap between an object and its handle")
    least_contacts: int = tunable(4, meaning="cells in which fragments meet that are joined")
    lightness_apart: float = tunable(
        38.0, unit="Lab", meaning="difference of lightness from which fragments are not alike"
    )
    colour_apart: float = tunable(14.0, unit="Lab", meaning="difference of a and b up to which fragments are alike")
    relative_colour_apart: float = tunable(0.22, meaning="the same as a share of the lightness")


@dataclass(frozen=True, slots=True)
class ObjectMaskOptions:
    """How masks of objects are made."""

    pad_px: int = tunable(10, unit="px", meaning="margin around the region that is looked at")
    closing_px: int = tunable(16, unit="px", meaning="pixels that a mask may grow by when it is closed and filled")
    speck_pixels: int = tunable(12, unit="px", meaning="smaller pieces are noise")
    follow_m: float = tunable(
        0.25, unit="m", meaning="how far around the table surfaces are followed, to see where arms come from"
    )
    margins_m: tuple[float, float, float] = tunable(
        (0.03, 0.15, 0.25 - 0.02), unit="m", meaning="margins around the table, see Reach"
    )
    border_px: int = tunable(
        2, unit="px", meaning="distance from the picture's border within which an object is cut off"
    )


@dataclass(frozen=True, slots=True)
class OnTableOptions:
    """Which surfaces are objects on the table."""

    least_pixels: int = tunable(45, unit="px", meaning="least number of pixels")
    least_extent_m: float = tunable(0.012, unit="m", meaning="least length")
    floating_m: float = tunable(0.03, unit="m", meaning="height of its lowest point from which a surface floats")
    tallest_m: float = tunable(0.45, unit="m", meaning="greatest height")
    in_the_air_m: float = tunable(
        0.07, unit="m", meaning="median height from which what lies beyond the table is no object on it"
    )
    low_m: float = tunable(0.012, unit="m", meaning="lower objects must be told from the table by their colour, too")
    unlike_table: float = tunable(
        5.0,
        unit="Lab",
        meaning="difference of colour from which an object is told from the table, lightness at half weight",
    )
    sliver_pixels: int = tunable(
        150, unit="px", meaning="smaller pieces along another object's outline are of that object, or of what it hides"
    )
    free_outline: float = tunable(
        0.5, meaning="share of a low object's outline that is table, from which it is an object"
    )
    few_outside: int = tunable(
        5, unit="px", meaning="pixels beyond what is followed that show something to come from outside"
    )
    inside_share: float = tunable(0.6, meaning="share of an object's points over the table from which it stands on it")
    long_outside_m: float = tunable(
        0.2, unit="m", meaning="length beyond the table from which what hangs in the air is an arm"
    )
    beside_share: float = tunable(0.9, meaning="share of points near the table that an object at its edge has")
    level_m: float = tunable(0.02, unit="m", meaning="height below which what is under an object is table")
    least_below_px: int = tunable(5, unit="px", meaning="pixels below an object that tell what it stands on")
    level_share: float = tunable(0.5, meaning="share of them that is level with the table")
    sunken_m: float = tunable(-0.02, unit="m", meaning="height below which they are lower than the table")
    sunken_share: float = tunable(0.15, meaning="greatest share of them that is lower")
    least_ring_px: int = tunable(20, unit="px", meaning="pixels around an object that tell the table's colour")


@dataclass(frozen=True, slots=True)
class PatchMergeOptions:
    """When two surface patches are of one object."""

    fold: float = tunable(
        0.22, meaning="sine of about the concave angle of a border that parts objects where their colours differ"
    )
    sharp_fold: float = tunable(0.5, meaning="and where they do not")
    alike: float = tunable(
        5.0, unit="Lab", meaning="difference of colour up to which patches are alike, lightness at half weight"
    )
    unlike: float = tunable(13.0, unit="Lab", meaning="difference of colour from which they are not")
    fold_softness: float = tunable(0.3, meaning="how far beyond the limit a fold counts fully")
    most_against: float = tunable(-1.5, meaning="least vote of one border")
    colour_weight: float = tunable(0.02, meaning="weight of colour in the order in which groups are joined")
    most_unlike: float = tunable(25.0, unit="Lab", meaning="greatest difference of colour that counts")
    noise_factor: float = tunable(1.5, meaning="standard errors of the normals that are added to a fold's limit")
    neck: float = tunable(0.3, meaning="share of an object's width that what joins it to another must be wider than")
    neck_alike: float = tunable(0.12, meaning="the same where colours are alike")
    bridge_weight: float = tunable(0.15, meaning="weight of a pixel's border in a narrow bridge")


@dataclass(frozen=True, slots=True)
class SplitOptions:
    """When a surface is looked at for touching objects, and how."""

    least_pixels: int = tunable(660, unit="px", meaning="smaller surfaces are one object")
    least_part_pixels: int = tunable(220, unit="px", meaning="pixels that an object has at least")
    least_part_share: float = tunable(0.04, meaning="the same as a share of the surface")
    small_top_m: float = tunable(0.045, unit="m", meaning="narrower objects on top of others are their caps and lids")
    stride: int = tunable(2, unit="px", meaning="every so manieth pixel is looked at")
    colour_stride: int = tunable(13, unit="px", meaning="every so manieth pixel is asked for its colour")
    rounds: int = tunable(4, meaning="rounds of giving small parts to their neighbours")
    even_colour: float = tunable(8.0, unit="Lab", meaning="spread of a and b within which a surface has one colour")
    even_share: float = tunable(0.92, meaning="share of its pixels within that spread")
    even_shaded: float = tunable(0.16, meaning="the same spread as a share of the lightness")
    solid: float = tunable(0.95, meaning="share of its convex outline in the image above which a surface is convex")


@dataclass(frozen=True, slots=True)
class SurfaceFitOptions:
    """Which surfaces belong to one object by their shape."""

    cell_m: float = tunable(0.005, unit="m", meaning="edge of the cells seen from above")
    fragment_pixels: int = tunable(90, unit="px", meaning="smaller surfaces are too little to tell a body")
    body_m: float = tunable(0.035, unit="m", meaning="height from which a surface is a body")
    within: float = tunable(0.7, meaning="share of a floor that lies within the rim, seen from above")
    within_alike: float = tunable(0.45, meaning="the same where their colours are alike: part of the rim may be hidden")
    holds: float = tunable(2.0, meaning="size of what is seen of an object over that of its handle, at least")
    holds_alike: float = tunable(0.15, meaning="the same where their colours are alike")
    floor_m: float = tunable(0.02, unit="m", meaning="height below which a surface may be a floor")
    beside_share: float = tunable(0.25, meaning="share of a surface within another below which it lies beside it")
    least_handle_m: float = tunable(0.025, unit="m", meaning="a shorter handle is no reason to look twice")
    highest_handle_m: float = tunable(0.12, unit="m", meaning="height of the highest handle")
    rim_m: float = tunable(
        0.025, unit="m", meaning="inside and outside of a hollow object end within this height of one rim"
    )
    bottle_height_m: float = tunable(0.1, unit="m", meaning="least height of a bottle")
    bottle_shoulder_m: float = tunable(0.01, unit="m", meaning="how far below the body's top a bottle's neck may begin")
    bottle_neck_m: float = tunable(0.075, unit="m", meaning="greatest width of a bottle's neck")
    bottle_neck_share: float = tunable(0.5, meaning="greatest height of a neck as a share of the body's")
    top_m: float = tunable(0.012, unit="m", meaning="thickness of the layer of points that is a top")
    top_width_m: float = tunable(0.028, unit="m", meaning="least width of a top")
    lowest_handle_m: float = tunable(0.02, unit="m", meaning="a handle begins at least so high")
    widest_handle_m: float = tunable(0.05, unit="m", meaning="greatest width of a handle")
    least_top_points: int = tunable(10, meaning="points that a top needs")


@dataclass(frozen=True, slots=True)
class SurfacePatchOptions:
    """How surfaces are cut into small patches."""

    least_spacing_px: int = tunable(6, unit="px", meaning="least distance between patches")
    colour: float = tunable(14.0, unit="Lab", meaning="difference of colour that is as far as one spacing is in space")
    slope: float = tunable(0.55, meaning="distance of unit normals that is as far as one spacing is in space")
    most: int = tunable(220, meaning="about so many patches of one surface; those of large ones are wider")
    least_points: int = tunable(6, meaning="points that a patch needs for a normal")


@dataclass(frozen=True, slots=True)
class WallOptions:
    """Which surfaces are walls behind the table."""

    least_length_m: float = tunable(0.6, unit="m", meaning="least length")
    least_height_m: float = tunable(0.12, unit="m", meaning="least height")
    half_thickness_m: float = tunable(0.012, unit="m", meaning="half the thickness of the layer of points on a wall")
    before_m: float = tunable(0.02, unit="m", meaning="what is nearer to a wall than this is the wall's")
    beyond_m: float = tunable(0.04, unit="m", meaning="how far behind the wall the table may seem to reach")
    least_share: float = tunable(0.35, meaning="share of a surface's points that a wall holds at least")
    points: int = tunable(1500, meaning="points that are looked at")
    tries: int = tunable(60, meaning="random lines that are tried")


COLOUR_FILL = ColourFillOptions()
FOREGROUND = ForegroundOptions()
ARM_MASK = ArmMaskOptions()
CAVITY = CavityOptions()
FRAGMENT_JOIN = FragmentJoinOptions()
OBJECT_MASKS = ObjectMaskOptions()
ON_TABLE = OnTableOptions()
PATCH_MERGE = PatchMergeOptions()
SPLIT = SplitOptions()
SURFACE_FIT = SurfaceFitOptions()
SURFACE_PATCHES = SurfacePatchOptions()
WALLS = WallOptions()
