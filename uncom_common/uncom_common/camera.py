# SPDX-License-Identifier: Apache-2.0
"""Pinhole camera geometry, the one place where pixels become metres and back.

Frames follow REP 103: an optical frame has x right, y down, z forward. Pixels are (u, v), u right, v down,
the centre of the top left pixel at (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_common.exceptions import InvalidConfigError
from uncom_common.options import PROJECTION

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PinholeCamera:
    """Intrinsics of an undistorted camera [px]."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        """Reject cameras that cannot project."""
        if self.fx <= 0.0 or self.fy <= 0.0:
            raise InvalidConfigError("fx, fy", (self.fx, self.fy), "focal lengths must be positive")
        if self.width <= 0 or self.height <= 0:
            raise InvalidConfigError("width, height", (self.width, self.height), "the image must have a size")

    def project(self, points: npt.ArrayLike) -> FloatArray:
        """Project points (N, 3) of the optical frame [m] to pixels (N, 2); points behind the camera give NaN."""
        p = np.atleast_2d(np.asarray(points, dtype=float))
        z = np.where(p[:, 2] > PROJECTION.min_depth_m, p[:, 2], np.nan)
        return np.column_stack([self.fx * p[:, 0] / z + self.cx, self.fy * p[:, 1] / z + self.cy])

    def deproject(self, pixels: npt.ArrayLike, depth: npt.ArrayLike) -> FloatArray:
        """Turn pixels (N, 2) with their depths (N,) along the optical axis [m] into points (N, 3) [m]."""
        uv = np.atleast_2d(np.asarray(pixels, dtype=float))
        z = np.atleast_1d(np.asarray(depth, dtype=float))
        return np.column_stack([(uv[:, 0] - self.cx) / self.fx * z, (uv[:, 1] - self.cy) / self.fy * z, z])

    def ray(self, pixel: npt.ArrayLike) -> FloatArray:
        """Return the unit direction (3,) in the optical frame that a pixel (2,) looks along."""
        u, v = np.asarray(pixel, dtype=float)
        direction = np.array([(u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0])
        return np.asarray(direction / np.linalg.norm(direction))
