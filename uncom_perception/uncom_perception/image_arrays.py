# SPDX-License-Identifier: Apache-2.0
"""Arrays of images: types, the check of what is taken for one, CIELAB, and order statistics that cost little.

np.percentile takes most of the time on a few hundred numbers; a partition does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.exceptions import InvalidImageError

FloatArray = npt.NDArray[np.float64]
RgbImage = npt.NDArray[np.uint8]
DepthImage = npt.NDArray[np.float32]


def check_rgb(image_rgb: RgbImage) -> None:
    """Reject what is not an RGB image (H, W, 3) uint8.

    Raises:
        InvalidImageError: it is not.
    """
    if image_rgb.shape[2:] != (3,) or image_rgb.dtype != np.uint8 or image_rgb.size == 0:
        raise InvalidImageError(f"need an RGB image (H, W, 3) uint8, got {image_rgb.shape} {image_rgb.dtype}")


_STEPS = np.arange(256, dtype=np.float32)
_UNITS = np.stack([_STEPS * np.float32(100.0 / 255.0), _STEPS - 128.0, _STEPS - 128.0], axis=-1)[None]


def lab_image(image_rgb: RgbImage, gain: float = 1.0) -> npt.NDArray[np.float32]:
    """Return lightness 0 to 100, a and b of a slightly smoothed picture (H, W, 3), to one unit of a and b.

    A dim picture is lightened by a gain above 1.
    """
    smooth = cv2.GaussianBlur(image_rgb, (3, 3), 0)
    lab = cv2.cvtColor(cv2.convertScaleAbs(smooth, alpha=gain) if gain > 1.0 else smooth, cv2.COLOR_RGB2LAB)
    return np.asarray(cv2.LUT(lab, _UNITS), dtype=np.float32)


Numbers = npt.NDArray[np.floating] | npt.NDArray[np.uint8]


def quantile(values: Numbers, percent: float) -> float:
    """Return the value below which so many percent of the values (N,) lie; N must be positive, NaN is not allowed."""
    place = round(percent / 100.0 * (values.size - 1))
    return float(np.partition(values, place, axis=None)[place])


def quantiles(values: Numbers, percents: Sequence[float]) -> list[float]:
    """Return several of them at once."""
    places = [round(percent / 100.0 * (values.size - 1)) for percent in percents]
    parted = np.partition(values, sorted(set(places)), axis=None)
    return [float(parted[place]) for place in places]


def medians(values: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """Return the median of each column of values (N, K)."""
    place = len(values) // 2
    return np.array([float(np.partition(values[:, k], place)[place]) for k in range(values.shape[1])])
