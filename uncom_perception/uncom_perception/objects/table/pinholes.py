# SPDX-License-Identifier: Apache-2.0
"""Single pixels that a depth camera lost all over the picture: what is about them tells what they are."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.table.options import DEPTH_CLEANING, DepthCleaningOptions

FloatImage = npt.NDArray[np.float32]


def without_pinholes(depth: FloatImage, *, options: DepthCleaningOptions = DEPTH_CLEANING) -> FloatImage:
    """Return a depth image (H, W) [m], NaN where unknown, in which single lost pixels are filled if they are many."""
    known = np.isfinite(depth).view(np.uint8)
    counts = cv2.boxFilter(known, -1, (3, 3), normalize=False)
    if np.count_nonzero((known == 0) & (counts >= options.surrounded)) < options.many_share * depth.size:
        return depth
    filled = np.where(known.view(bool), depth, np.float32(0.0))
    kernel = np.ones((3, 3), np.uint8)
    for _ in range(options.rounds):
        known = (filled > 0.0).view(np.uint8)
        counts = cv2.boxFilter(known, -1, (3, 3), normalize=False)
        farthest = cv2.dilate(filled, kernel)
        nearest = cv2.erode(np.where(known.view(bool), filled, np.float32(np.inf)), kernel)
        sure = (known == 0) & (counts >= options.least_known) & (farthest - nearest < options.agree * farthest)
        mean = cv2.boxFilter(filled, -1, (3, 3), normalize=False) / np.maximum(counts, 1)
        filled[sure] = mean[sure]
    return np.where(filled > 0.0, filled, np.float32(np.nan)).astype(np.float32)
