# SPDX-License-Identifier: Apache-2.0
"""Pictures in CIELAB."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.detector import RgbImage


def lab_image(image_rgb: RgbImage) -> npt.NDArray[np.float32]:
    """Return lightness 0 to 100, a and b of a slightly smoothed picture (H, W, 3), to one unit of a and b."""
    lab = np.asarray(cv2.cvtColor(cv2.GaussianBlur(image_rgb, (3, 3), 0), cv2.COLOR_RGB2LAB), dtype=np.float32)
    lab *= np.array([100.0 / 255.0, 1.0, 1.0], np.float32)
    lab -= np.array([0.0, 128.0, 128.0], np.float32)
    return lab
