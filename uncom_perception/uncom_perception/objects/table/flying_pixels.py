# SPDX-License-Identifier: Apache-2.0
"""Depth that belongs to no surface: cameras smear the step from a thing to what is behind it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.table.options import DEPTH_CLEANING, DepthCleaningOptions

FloatImage = npt.NDArray[np.float32]


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
