# SPDX-License-Identifier: Apache-2.0
"""Walls and the fronts of cupboards that a table stands against: no things, and no part of what stands before them."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.foreground import Surfaces, connected
from uncom_perception.objects.segments.regions import Regions, regions_of
from uncom_perception.objects.table.order_statistics import quantile
from uncom_perception.types import FloatArray, Mask

_LEAST_LONG_M, _LEAST_HIGH_M = 0.6, 0.12
_THICK_M = 0.012  # of the layer of points on a wall, half
_BEFORE_M = 0.02  # what is nearer to a wall than this is the wall's
_BEYOND_M = 0.04  # the table may seem to reach so far behind the wall
_LEAST_SHARE = 0.35  # of the points of a surface that a wall is the larger part of
_POINTS, _TRIES = 1500, 60


def without_walls(
    surfaces: Surfaces, pixels: Mask, regions: Regions, outline: FloatArray, least: int
) -> tuple[Mask, Regions]:
    """Return what is above the table (H, W) and its surfaces, without walls at the edge of its outline (N, 2) [m].

    A wall is upright, long and high, and no table is behind it. Surfaces of fewer pixels than the least are left out.
    """
    left = pixels
    for label in np.flatnonzero(regions.sizes >= _POINTS // 2).tolist():
        own = regions.of(label)
        points = surfaces.ground_points.reshape(-1, 3)[own]
        wall = _wall(points[:: 1 + len(points) // _POINTS].astype(float), outline)
        if wall is None:
            continue
        if left is pixels:
            left = pixels.copy()
        normal, offset = wall
        left.ravel()[own[points[:, :2] @ normal > offset - _BEFORE_M]] = False
    if left is pixels:
        return pixels, regions
    return left, regions_of(connected(surfaces, left), least)


def _wall(points: FloatArray, outline: FloatArray) -> tuple[npt.NDArray[np.float64], float] | None:
    """Return normal (2,) and offset [m] of a wall among points (N, 3), the table (N, 2) before it; None without one."""
    if len(points) < 3 or quantile(points[:, 2], 98) < _LEAST_HIGH_M:
        return None
    flat = points[:, :2]
    if max(cv2.minAreaRect(flat.astype(np.float32))[1]) < _LEAST_LONG_M:
        return None
    rng = np.random.default_rng(0)
    a, b = flat[rng.integers(0, len(flat), _TRIES)], flat[rng.integers(0, len(flat), _TRIES)]
    far = np.linalg.norm(b - a, axis=1) > 0.3 * _LEAST_LONG_M
    if not far.any():
        return None
    along = (b[far] - a[far]) / np.linalg.norm(b[far] - a[far], axis=1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    offsets = np.einsum("ij,ij->i", normals, a[far])
    near = np.abs(flat @ normals.T - offsets) < _THICK_M
    best = int(near.sum(axis=0).argmax())
    on = near[:, best]
    if on.mean() < _LEAST_SHARE or np.ptp(flat[on] @ along[best]) < _LEAST_LONG_M:
        return None
    normal, offset = normals[best], float(np.median(flat[on] @ normals[best]))
    if float((outline @ normal).mean()) > offset:
        normal, offset = -normal, -offset
    high = points[on, 2]
    upright = quantile(high, 95) > _LEAST_HIGH_M and quantile(high, 95) - quantile(high, 5) > 0.5 * _LEAST_HIGH_M
    return (normal, offset) if upright and float((outline @ normal).max()) < offset + _BEYOND_M else None
