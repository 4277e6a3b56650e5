# SPDX-License-Identifier: Apache-2.0
"""Colours by name, as people say them, as sRGB from 0 to 1."""

from __future__ import annotations

Rgb = tuple[float, float, float]

COLOURS: dict[str, Rgb] = {
    "red": (0.76, 0.10, 0.10),
    "orange": (0.95, 0.50, 0.08),
    "yellow": (0.95, 0.80, 0.14),
    "green": (0.16, 0.54, 0.22),
    "blue": (0.11, 0.29, 0.70),
    "purple": (0.45, 0.18, 0.60),
    "pink": (0.93, 0.50, 0.65),
    "brown": (0.42, 0.25, 0.13),
    "white": (0.93, 0.93, 0.91),
    "black": (0.07, 0.07, 0.08),
    "grey": (0.52, 0.53, 0.54),
    "beige": (0.86, 0.76, 0.58),
}
SPELLINGS = {"gray": "grey", "violet": "purple", "cream": "beige"}
STEEL: Rgb = (0.72, 0.73, 0.75)


def mixed(a: Rgb, b: Rgb, share: float) -> Rgb:
    """Return the colour share (0 to 1) of the way from a to b."""
    return (a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share)
