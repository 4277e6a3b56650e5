# SPDX-License-Identifier: Apache-2.0
"""Array types of colour and depth images, and the check of what is taken for one."""

from __future__ import annotations

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
