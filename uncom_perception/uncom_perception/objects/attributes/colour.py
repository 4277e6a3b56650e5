# SPDX-License-Identifier: Apache-2.0
"""Colour names in CIELAB.

Each name has a few exemplars (the centres and some borders of the basic colour terms of Berlin and Kay as sRGB
surfaces are usually named); a colour's probabilities fall with its distance to them. Lightness counts less than hue,
because one surface is seen light and dark.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantiles
from uncom_perception.objects.attributes.options import COLOUR_NAMING, ColourNamingOptions

FloatArray = npt.NDArray[np.float64]
RgbImage = npt.NDArray[np.uint8]

_EXEMPLARS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "red": ((45, 66, 48), (33, 52, 34), (52, 70, 45), (26, 40, 26), (40, 58, 25)),
    "orange": (
        *((67, 42, 68), (60, 46, 62), (74, 32, 72), (56, 38, 58), (68, 48, 60)),
        *((38, 24, 44), (45, 30, 50)),
    ),
    "yellow": ((86, 0, 78), (80, 6, 72), (92, -10, 70), (70, 4, 66), (88, -2, 50), (76, 14, 76), (60, 4, 58)),
    "green": (
        *((50, -42, 30), (65, -40, 40), (35, -28, 22), (80, -45, 45), (25, -20, 14), (55, -14, 48), (68, -20, 56)),
        *((72, -28, 58), (45, -30, 8), (40, -12, 36)),
    ),
    "blue": ((35, 18, -58), (30, 12, -45), (50, -2, -40), (65, -12, -30), (22, 16, -38), (75, -14, -18), (40, 4, -46)),
    "purple": ((35, 42, -38), (30, 36, -34), (48, 40, -36), (60, 32, -32), (24, 26, -24), (38, 46, -20)),
    "pink": ((72, 32, 4), (80, 22, 4), (65, 45, 0), (60, 55, -8), (62, 36, 10), (55, 42, 2), (84, 14, 4)),
    "brown": ((36, 18, 24), (45, 18, 30), (28, 14, 18), (50, 16, 32), (22, 10, 13), (38, 22, 28), (55, 14, 30)),
    "beige": ((80, 4, 22), (86, 2, 16), (74, 6, 26), (68, 6, 22), (82, 3, 28)),
    "white": ((95, 0, 0), (88, 0, 2), (90, 0, -4), (90, 1, 6), (85, -1, 9), (82, 0, 0), (81, 0, 3), (81, 0, -3)),
    "grey": (
        *((56, 0, 0), (63, 0, 0), (45, 0, 0), (36, 0, 0), (56, -2, -6), (50, 2, 5)),
        *((70, 0, 0), (68, 0, 3), (68, 0, -3)),
    ),
    "black": ((5, 0, 0), (14, 0, 0), (20, 0, 0), (10, 2, -4)),
}
COLOUR_NAMES = tuple(_EXEMPLARS)
COLOUR_WORDS = {name: name for name in COLOUR_NAMES} | {
    "gray": "grey",
    "silver": "grey",
    "silvery": "grey",
    "metallic": "grey",
    "violet": "purple",
    "magenta": "purple",
    "lilac": "purple",
    "cream": "beige",
    "tan": "beige",
    "golden": "yellow",
    "crimson": "red",
    "scarlet": "red",
    "navy": "blue",
    "turquoise": "blue",
    "cyan": "blue",
    "lime": "green",
    "rose": "pink",
}


@functools.cache
def _table(*, options: ColourNamingOptions = COLOUR_NAMING) -> npt.NDArray[np.float32]:
    """Return the probability of each name for each of 32 x 32 x 32 sRGB colours, (32, 32, 32, names)."""
    step = 256 // options.bins
    axis = (np.arange(options.bins) * step + step // 2).astype(np.float32) / 255.0
    rgb = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).astype(np.float32)
    lab = cv2.cvtColor(rgb.reshape(1, -1, 3), cv2.COLOR_RGB2LAB)[0].astype(float)
    return (
        _name_probabilities(lab, options=options)
        .reshape(options.bins, options.bins, options.bins, -1)
        .astype(np.float32)
    )


def _name_probabilities(lab: FloatArray, *, options: ColourNamingOptions = COLOUR_NAMING) -> FloatArray:
    scale = np.array([options.lightness_weight, 1.0, 1.0])
    distances = []
    for exemplars in _EXEMPLARS.values():
        difference = (lab[:, None, :] - np.array(exemplars, dtype=float)) * scale
        distances.append(np.linalg.norm(difference, axis=2).min(axis=1))
    d = np.column_stack(distances)
    likelihood = np.exp(
        -0.5 * ((d - d.min(axis=1, keepdims=True)) * (d + d.min(axis=1, keepdims=True))) / options.sigma**2
    )
    return np.asarray(likelihood / likelihood.sum(axis=1, keepdims=True))


def _value(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    return np.maximum(np.maximum(pixels[..., 0], pixels[..., 1]), pixels[..., 2])


def name_colours(
    pixels: npt.NDArray[np.uint8], gain: float = 1.0, *, options: ColourNamingOptions = COLOUR_NAMING
) -> dict[str, float]:
    """Return the share of each colour name among pixels (N, 3), strongest first; shares sum to 1.

    A surface's colour is that of its lit part: pixels in the shade are lifted to the lightest ones of their chroma.
    """
    if len(pixels) == 0:
        return {}
    lit = np.clip(pixels * (_lift(pixels, options=options) * np.float32(gain))[:, None], 0, 255).astype(np.uint8)
    binned = lit // (256 // options.bins)
    names = _table(options=options)[binned[:, 0], binned[:, 1], binned[:, 2]]
    value = _value(pixels)
    low, high = quantiles(value, (25, 97))
    weight = np.where(value < low, 0.5, np.where(value > high + 4.0, 0.3, 1.0))
    shares = weight @ names / weight.sum()
    order = np.argsort(-shares)
    return {COLOUR_NAMES[i]: float(shares[i]) for i in order}


def _lift(pixels: npt.NDArray[np.uint8], *, options: ColourNamingOptions = COLOUR_NAMING) -> npt.NDArray[np.float32]:
    """Return by how much each pixel (N, 3) seems to be darkened by shade, at least 1.

    Light of one colour scales lightness and chroma alike, so that chroma / lightness tells surfaces from shades.
    """
    lab = cv2.cvtColor(pixels[None].astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2LAB)[0]
    relative = np.round(lab[:, 1:] / (lab[:, :1] + 16.0) / options.chroma_step).astype(np.int32)
    kind = (relative[:, 0] + 50) * 100 + relative[:, 1] + 50
    value = _value(pixels).astype(np.float32)
    factor = np.ones(len(pixels), np.float32)
    for code in np.flatnonzero(np.bincount(kind) >= max(25, 0.04 * len(pixels))):
        own = kind == code
        middle, light = quantiles(value[own], (50, 97))
        # Where little of an object is lit, its lightest pixels are a mixture with shade: it is lighter than they are.
        light *= 1.0 + 0.5 * (1.0 - middle / max(light, 1.0))
        factor[own] = np.clip(light / np.maximum(value[own], 1.0), 1.0, options.deepest_shade)
    return factor


def colour_probability(shares: Mapping[str, float], name: str) -> float:
    """Return how well an object with these shares is called by a colour: fully if that is its main colour."""
    return float(colour_probabilities(shares)[COLOUR_NAMES.index(name)])


def colour_probabilities(shares: Mapping[str, float]) -> FloatArray:
    """Return it for all colour names."""
    share = np.array([shares.get(name, 0.0) for name in COLOUR_NAMES])
    top = float(share.max())
    return np.clip(share * (0.8 / top + 0.2), 0.0, 1.0) if top > 0.0 else np.zeros(len(share))
