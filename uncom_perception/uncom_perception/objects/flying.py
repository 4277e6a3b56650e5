# SPDX-License-Identifier: Apache-2.0
"""Depth that belongs to no surface: cameras smear the step from a thing to what is behind it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatImage = npt.NDArray[np.float32]

_STEEPEST = 4.5  # tangent of the angle between line of sight and normal that surfaces are still seen at (77 degrees)


def without_flying(depth: FloatImage, focal_px: float) -> FloatImage:
    """Return a depth image (H, W) [m] without the pixels that hang between a nearer and a farther neighbour.

    At a sharp edge either side has neighbours of its own; on a smear every pixel steps on both sides, the same way.
    """
    limit = depth * np.float32(_STEEPEST / focal_px)
    flying = np.zeros(depth.shape, bool)
    with np.errstate(invalid="ignore"):
        across, down = np.diff(depth, axis=1), np.diff(depth, axis=0)
        for step, inner in ((across, np.s_[:, 1:-1]), (down, np.s_[1:-1])):
            one, other = (step[:, :-1], step[:, 1:]) if step is across else (step[:-1], step[1:])
            bound = limit[inner]
            flying[inner] |= ((one > bound) & (other > bound)) | ((one < -bound) & (other < -bound))
    return np.where(flying, np.float32(np.nan), depth)
