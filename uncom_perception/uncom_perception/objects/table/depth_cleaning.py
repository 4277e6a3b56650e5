# SPDX-License-Identifier: Apache-2.0
"""Depth pixels that are mended or dropped.

Single pixels that a camera lost all over the picture are filled from what is about them. Pixels that belong to no
surface, where the camera smears the step from an object to what is behind it, are dropped.
"""

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


def without_flying(depth: FloatImage, focal_px: float, *, options: DepthCleaningOptions = DEPTH_CLEANING) -> FloatImage:
    """Return a depth image (H, W) [m] without the pixels that hang between a nearer and a farther neighbour.

    At a sharp edge either side has neighbours of its own; on a smear every pixel steps on both sides, the same way.
    """
    limit = depth * np.float32(options.steepest / focal_px)
    flying = []
    with np.errstate(invalid="ignore"):
        for beside in (1, depth.shape[1]):
            # Steps from each pixel to the next one along a row, or a column; few are large enough to be looked at.
            steps = depth.ravel()[beside:] - depth.ravel()[:-beside]
            large = np.flatnonzero(np.abs(steps[beside:]) > limit.ravel()[beside:-beside])
            one, other, bound = steps[large], steps[large + beside], limit.ravel()[large + beside]
            found = large[((one > bound) & (other > bound)) | ((one < -bound) & (other < -bound))] + beside
            flying.append(found[(found + 1) % depth.shape[1] > 1] if beside == 1 else found)
    result = depth.copy()
    result.ravel()[np.concatenate(flying)] = np.nan
    return result
