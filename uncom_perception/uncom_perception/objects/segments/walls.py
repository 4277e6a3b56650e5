# SPDX-License-Identifier: Apache-2.0
"""Walls and the fronts of cupboards that a table stands against: no objects, and no part of what stands before them."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.segments.foreground import Surfaces, connected
from uncom_perception.objects.segments.options import WALLS, WallOptions
from uncom_perception.objects.segments.regions import Regions, regions_of
from uncom_perception.types import LEAST_CORNERS, FloatArray, Mask


def without_walls(
    surfaces: Surfaces, pixels: Mask, regions: Regions, outline: FloatArray, least: int, *, options: WallOptions = WALLS
) -> tuple[Mask, Regions]:
    """Return what is above the table (H, W) and its surfaces, without walls at the edge of its outline (N, 2) [m].

    A wall is upright, long and high, and no table is behind it. Surfaces of fewer pixels than the least are left out.
    """
    left = pixels
    for label in np.flatnonzero(regions.sizes >= options.points // 2).tolist():
        own = regions.of(label)
        points = surfaces.ground_points.reshape(-1, 3)[own]
        wall = _wall(points[:: 1 + len(points) // options.points].astype(float), outline, options=options)
        if wall is None:
            continue
        if left is pixels:
            left = pixels.copy()
        normal, offset = wall
        left.ravel()[own[points[:, :2] @ normal > offset - options.before_m]] = False
    if left is pixels:
        return pixels, regions
    return left, regions_of(connected(surfaces, left), least)


def _wall(
    points: FloatArray, outline: FloatArray, *, options: WallOptions = WALLS
) -> tuple[npt.NDArray[np.float64], float] | None:
    """Return normal (2,) and offset [m] of a wall among points (N, 3), the table (N, 2) before it; None without one."""
    if len(points) < LEAST_CORNERS or quantile(points[:, 2], 98) < options.least_height_m:
        return None
    flat = points[:, :2]
    if max(cv2.minAreaRect(flat.astype(np.float32))[1]) < options.least_length_m:
        return None
    rng = np.random.default_rng(0)
    a, b = flat[rng.integers(0, len(flat), options.tries)], flat[rng.integers(0, len(flat), options.tries)]
    far = np.linalg.norm(b - a, axis=1) > 0.3 * options.least_length_m
    if not far.any():
        return None
    along = (b[far] - a[far]) / np.linalg.norm(b[far] - a[far], axis=1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    offsets = np.einsum("ij,ij->i", normals, a[far])
    near = np.abs(flat @ normals.T - offsets) < options.half_thickness_m
    best = int(near.sum(axis=0).argmax())
    on = near[:, best]
    if on.mean() < options.least_share or np.ptp(flat[on] @ along[best]) < options.least_length_m:
        return None
    normal, offset = normals[best], float(np.median(flat[on] @ normals[best]))
    if float((outline @ normal).mean()) > offset:
        normal, offset = -normal, -offset
    high = points[on, 2]
    upright = (
        quantile(high, 95) > options.least_height_m
        and quantile(high, 95) - quantile(high, 5) > 0.5 * options.least_height_m
    )
    return (normal, offset) if upright and float((outline @ normal).max()) < offset + options.beyond_m else None
