# SPDX-License-Identifier: Apache-2.0
"""How well a picture is lit, and what a dim one would look like in usual light."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.options import EXPOSURE, ExposureOptions

RgbImage = npt.NDArray[np.uint8]


def exposure(image_rgb: RgbImage, *, options: ExposureOptions = EXPOSURE) -> float:
    """Return the factor that brings a dim or glaring picture to where a well lit one is.

    On the whole pictures are about equally light; but the lightest surfaces must not grow lighter than white paper, nor
    stay darker than a light grey.
    """
    usual, bright = _usual_and_bright(image_rgb)
    least, most = max(options.least_gain, options.well_lit / bright), max(1.0, options.white / bright)
    return float(np.clip(options.usual / usual, least, min(most, options.greatest_gain)))


def lightened(image_rgb: RgbImage, *, options: ExposureOptions = EXPOSURE) -> RgbImage:
    """Return a dim picture as it would be in usual light, any other as it is."""
    gain = exposure(image_rgb, options=options)
    return np.asarray(cv2.convertScaleAbs(image_rgb, alpha=gain), np.uint8) if gain > options.dim_gain else image_rgb


def _usual_and_bright(image_rgb: RgbImage) -> tuple[float, float]:
    """Return how light half of a picture and its lightest surfaces are, 1 to 255."""
    some = np.ascontiguousarray(image_rgb[::4, ::4])
    value = np.maximum(np.maximum(some[..., 0], some[..., 1]), some[..., 2]).ravel()
    places = [round(share * (len(value) - 1)) for share in (0.5, 0.985)]
    parted = np.partition(value, places)
    usual, bright = (max(float(parted[place]), 1.0) for place in places)
    return usual, bright
