# SPDX-License-Identifier: Apache-2.0
"""Noise of the camera: the palm detector finds nothing in pictures that people see hands in at once."""

from __future__ import annotations

import math

import cv2
import numpy as np

from uncom_perception.hands.detector import RgbImage

_CLEAN = 4.0  # grey levels: what a picture with fine texture has, too
_BLUR_PX = 0.09  # per grey level of noise: so much that about a quarter of the noise is left
_ROW_STEP, _PIECE = 8, 32
_CALM = 0.25  # share of the places that have no texture, in most pictures
_MEDIAN_OF_NORMAL = 0.6745


def noise_level(image_rgb: RgbImage) -> float:
    """Return the standard deviation of an image's noise from pixel to pixel [grey levels].

    It is that of second differences along pieces of some rows: surfaces and shading have none, edges are few. Texture
    is in places, noise is everywhere, so that the calmer places tell it.
    """
    rows = image_rgb[::_ROW_STEP, :, 1].astype(np.float32)
    pieces = (rows.shape[1] - 2) // _PIECE
    if pieces < 1:
        return 0.0
    bend = np.abs(rows[:, :-2] - 2.0 * rows[:, 1:-1] + rows[:, 2:])[:, : pieces * _PIECE]
    levels = np.median(bend.reshape(len(rows), pieces, _PIECE), axis=2)
    return float(np.quantile(levels, _CALM)) / _MEDIAN_OF_NORMAL / math.sqrt(6.0)


def without_noise(image_rgb: RgbImage) -> RgbImage:
    """Return a noisy picture (H, W, 3) smoothed as much as its noise asks for, any other as it is."""
    level = noise_level(image_rgb)
    if level <= _CLEAN:
        return image_rgb
    return np.asarray(cv2.GaussianBlur(image_rgb, (0, 0), _BLUR_PX * level), np.uint8)
