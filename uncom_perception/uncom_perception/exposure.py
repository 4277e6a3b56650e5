# SPDX-License-Identifier: Apache-2.0
"""How well a picture is lit, and what a dim one would look like in usual light."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

RgbImage = npt.NDArray[np.uint8]

_WELL_LIT, _WHITE = 160.0, 235.0  # where the lightest surfaces of a picture are, at least and at most
_USUAL = 130.0  # how light the half of a picture is
_LEAST_GAIN, _MOST_GAIN = 0.85, 4.0
_DIM = 1.5  # from this gain on a picture is worth lightening


def exposure(image_rgb: RgbImage) -> float:
    """Return the factor that brings a dim or glaring picture to where a well lit one is.

    On the whole pictures are about equally light; but the lightest surfaces must not grow lighter than white paper, nor
    stay darker than a light grey.
    """
    usual, bright = _usual_and_bright(image_rgb)
    least, most = max(_LEAST_GAIN, _WELL_LIT / bright), max(1.0, _WHITE / bright)
    return float(np.clip(_USUAL / usual, least, min(most, _MOST_GAIN)))


def lightened(image_rgb: RgbImage) -> RgbImage:
    """Return a dim picture as it would be in usual light, any other as it is."""
    gain = exposure(image_rgb)
    return np.asarray(cv2.convertScaleAbs(image_rgb, alpha=gain), np.uint8) if gain > _DIM else image_rgb


def _usual_and_bright(image_rgb: RgbImage) -> tuple[float, float]:
    """Return how light half of a picture and its lightest surfaces are, 1 to 255."""
    some = np.ascontiguousarray(image_rgb[::4, ::4])
    value = np.maximum(np.maximum(some[..., 0], some[..., 1]), some[..., 2]).ravel()
    places = [round(share * (len(value) - 1)) for share in (0.5, 0.985)]
    parted = np.partition(value, places)
    usual, bright = (max(float(parted[place]), 1.0) for place in places)
    return usual, bright
