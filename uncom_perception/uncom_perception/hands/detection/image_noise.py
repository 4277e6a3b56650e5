# SPDX-License-Identifier: Apache-2.0
"""Noise of the camera: the palm detector finds nothing in pictures that people see hands in at once."""

from __future__ import annotations

import math

import cv2
import numpy as np

from uncom_perception.hands.detection.options import IMAGE_NOISE, ImageNoiseOptions
from uncom_perception.image_arrays import RgbImage

_MEDIAN_OF_NORMAL = 0.6745


def noise_level(image_rgb: RgbImage, *, options: ImageNoiseOptions = IMAGE_NOISE) -> float:
    """Return the standard deviation of an image's noise from pixel to pixel [grey levels].

    It is that of second differences along pieces of some rows: surfaces and shading have none, edges are few. Texture
    is in places, noise is everywhere, so that the calmer places tell it.
    """
    rows = image_rgb[:: options.row_step, :, 1].astype(np.float32)
    pieces = (rows.shape[1] - 2) // options.piece_px
    if pieces < 1:
        return 0.0
    bend = np.abs(rows[:, :-2] - 2.0 * rows[:, 1:-1] + rows[:, 2:])[:, : pieces * options.piece_px]
    levels = np.median(bend.reshape(len(rows), pieces, options.piece_px), axis=2)
    return float(np.quantile(levels, options.calm_share)) / _MEDIAN_OF_NORMAL / math.sqrt(6.0)


def without_noise(image_rgb: RgbImage, *, options: ImageNoiseOptions = IMAGE_NOISE) -> RgbImage:
    """Return a noisy picture (H, W, 3) smoothed as much as its noise asks for, any other as it is."""
    level = noise_level(image_rgb, options=options)
    if level <= options.clean:
        return image_rgb
    return np.asarray(cv2.GaussianBlur(image_rgb, (0, 0), options.blur_px_per_level * level), np.uint8)
