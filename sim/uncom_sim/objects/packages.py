# SPDX-License-Identifier: Apache-2.0
"""Packages and bottles: box, cereal box, bottle, can."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from uncom_sim.objects.model import TILE_PX, Contact, Model, Tile, assemble, flat_tile, paint
from uncom_sim.objects.palette import COLOURS, STEEL, Rgb, mixed
from uncom_sim.objects.shapes import box_hull, disc_hull, revolve, rounded_box, smooth_profile, turned_hull

FloatArray = npt.NDArray[np.float64]

CARDBOARD = Contact(friction=0.7, spinning=0.002)
# A bottle or can that fell over must not roll off the table for ever.
BARREL = Contact(friction=0.7, rolling=0.001, spinning=0.002)


def box(colour: Rgb) -> Model:
    """Closed cardboard box with a strip of tape: 15 x 7.6 x 9 cm, 200 g."""
    size = (0.15, 0.076, 0.09)
    body = paint(rounded_box(size, 0.002, 2), colour)
    tape_colour = mixed(colour, COLOURS["white"], 0.35)
    tape = paint(
        rounded_box((size[0] + 0.0006, 0.018, 0.0008), 0.0003, 1).apply_translation([0, 0, size[2]]), tape_colour
    )
    return assemble([body, tape], [box_hull(size, (0.0, 0.0, size[2] / 2.0))], 0.2, CARDBOARD)


def cereal_box(colour: Rgb) -> Model:
    """Upright printed box: 15.5 x 5.5 x 21.5 cm, 300 g; the wide faces look along y."""
    size = (0.155, 0.055, 0.215)
    body = paint(rounded_box(size, 0.0015, 2), _printed(colour), _front_uv(size))
    return assemble([body], [box_hull(size, (0.0, 0.0, size[2] / 2.0))], 0.3, CARDBOARD)


def bottle(colour: Rgb) -> Model:
    """6.6 cm across, 21 cm high, cap and label, 380 g."""
    points = [
        (0.030, 0.0),
        (0.033, 0.004),
        (0.033, 0.060),
        (0.033, 0.120),
        (0.030, 0.142),
        (0.018, 0.166),
        (0.0135, 0.178),
    ]
    wall = [(0.0, 0.0), points[0], *smooth_profile(points[1:], 16), (0.0130, 0.192)]
    skin = paint(revolve(wall, 32), colour, crease_deg=45)
    label = paint(
        revolve([(0.0333, 0.055), (0.0336, 0.056), (0.0336, 0.104), (0.0333, 0.105)], 32),
        mixed(colour, COLOURS["white"], 0.75),
    )
    cap = paint(
        revolve([(0.0152, 0.190), (0.0155, 0.191), (0.0155, 0.208), (0.0145, 0.210), (0.0, 0.210)], 24),
        COLOURS["white"],
    )
    hulls = [
        disc_hull(0.033, 0.0, 0.125, 18),
        turned_hull([(0.033, 0.125), (0.030, 0.142), (0.016, 0.170)], 14),
        disc_hull(0.0155, 0.168, 0.210, 10),
    ]
    return assemble([skin, label, cap], hulls, 0.38, BARREL)


def can(colour: Rgb) -> Model:
    """Drink can: 6.6 cm across, 11.5 cm high, metal ends, 370 g."""
    body = paint(
        revolve([(0.028, 0.004), (0.0328, 0.009), (0.0328, 0.104), (0.0285, 0.1125)], 32), colour, crease_deg=30
    )
    band = paint(
        revolve([(0.0329, 0.042), (0.0331, 0.0425), (0.0331, 0.0625), (0.0329, 0.063)], 32),
        mixed(colour, COLOURS["white"], 0.7),
    )
    ends = [
        revolve([(0.0, 0.006), (0.024, 0.006), (0.0265, 0.0), (0.0287, 0.005)], 32),
        revolve([(0.0288, 0.112), (0.0285, 0.115), (0.0265, 0.115), (0.0255, 0.1132), (0.0, 0.1132)], 32),
    ]
    parts = [body, band, *(paint(end, STEEL) for end in ends)]
    hull = turned_hull([(0.0265, 0.0), (0.033, 0.009), (0.033, 0.104), (0.0265, 0.115)], 20)
    return assemble(parts, [hull], 0.37, BARREL)


def _front_uv(size: tuple[float, float, float]) -> Callable[[FloatArray, FloatArray], FloatArray]:
    def place(v: FloatArray, n: FloatArray) -> FloatArray:
        """Print the wide faces; every other face takes the plain border of the print."""
        uv = np.column_stack([np.sign(-n[:, 1]) * v[:, 0] / size[0] + 0.5, 1.0 - v[:, 2] / size[2]])
        sideways, border = 0.7, 0.02  # a normal's part along y, and the place of the border in the print
        uv[np.abs(n[:, 1]) < sideways] = border
        return uv

    return place


def _printed(colour: Rgb) -> Tile:
    """Draw a front: a light band with dark letters, and a bowl with grains on a disc."""
    tile = flat_tile(colour)
    v, u = (np.mgrid[0:TILE_PX, 0:TILE_PX] + 0.5) / TILE_PX
    light = np.asarray(mixed(colour, COLOURS["white"], 0.85)) * 255.0
    dark = np.asarray(mixed(colour, COLOURS["black"], 0.7)) * 255.0
    # Half sizes and radii as shares of the tile; gaps as shares of the distance from one letter or grain to the next.
    band_v, band_u, letters_v, letters_u, letter_gap = 0.085, 0.40, 0.045, 0.34, 0.35
    middle, disc, bowl, grain_share, grains_u, grains_v = 0.66, 0.24, 0.17, 0.45, 0.15, 0.035
    tile[(np.abs(v - 0.22) < band_v) & (np.abs(u - 0.5) < band_u)] = light
    letters = (np.abs(v - 0.22) < letters_v) & (np.abs(u - 0.5) < letters_u) & ((u * 14.0) % 1.0 > letter_gap)
    tile[letters] = dark
    tile[(u - 0.5) ** 2 + ((v - middle) * 1.35) ** 2 < disc**2] = light
    tile[((u - 0.5) ** 2 + ((v - middle) * 1.35) ** 2 < bowl**2) & (v > middle)] = dark
    grains = ((u * 19.0) % 1.0 < grain_share) & ((v * 23.0) % 1.0 < grain_share)
    grains &= (np.abs(u - 0.5) < grains_u) & (np.abs(v - 0.62) < grains_v)
    tile[grains] = np.asarray(COLOURS["beige"]) * 220.0
    return tile
