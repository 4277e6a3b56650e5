# SPDX-License-Identifier: Apache-2.0
"""Pictures in CIELAB."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_types import RgbImage

_STEPS = np.arange(256, dtype=np.float32)
_UNITS = np.stack([_STEPS * np.float32(100.0 / 255.0), _STEPS - 128.0, _STEPS - 128.0], axis=-1)[None]


def lab_image(image_rgb: RgbImage, gain: float = 1.0) -> npt.NDArray[np.float32]:
    """Return lightness 0 to 100, a and b of a slightly smoothed picture (H, W, 3), to one unit of a and b.

    A dim picture is lightened by a gain above 1.
    """
    smooth = cv2.GaussianBlur(image_rgb, (3, 3), 0)
    lab = cv2.cvtColor(cv2.convertScaleAbs(smooth, alpha=gain) if gain > 1.0 else smooth, cv2.COLOR_RGB2LAB)
    return np.asarray(cv2.LUT(lab, _UNITS), dtype=np.float32)
