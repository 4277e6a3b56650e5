# SPDX-License-Identifier: Apache-2.0
"""A depth image seen from the table: the plane, its outline, and every pixel's place over it."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import cv2
import numpy as np
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import invert

from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.image_arrays import DepthImage, FloatArray, quantile
from uncom_perception.objects.table.depth_cleaning import without_flying, without_pinholes
from uncom_perception.objects.table.depth_noise import bow
from uncom_perception.objects.table.options import TABLE_VIEW, TableViewOptions
from uncom_perception.objects.table.table_outline import (
    Ground,
    PointImage,
    TopDown,
    find_table,
    ground_frame,
    table_pixels,
)
from uncom_perception.objects.table.table_plane import find_table_plane
from uncom_perception.types import Mask, TableSurface


@dataclass(frozen=True, slots=True)
class TableView:
    """What a depth image says about the table.

    Points (H, W, 3) are x, y on the table and height above it [m]; the viewer (3,) is where the camera is in the same
    frame; the outline (N, 2) is that of the table top [m]; ranges (H, W) are along the lines of sight [m].
    """

    ground: Ground
    points: PointImage
    on_table: Mask
    surface: TableSurface
    outline: FloatArray
    depth: DepthImage
    range_m: DepthImage
    pixel_m: float
    viewer: FloatArray

    def cut(self, box: tuple[slice, slice]) -> TableView:
        """Return a part of it."""
        points = np.ascontiguousarray(self.points[box])
        on_table, depth, away = self.on_table[box], self.depth[box], self.range_m[box]
        return replace(self, points=points, on_table=on_table, depth=depth, range_m=away)

    def box_of(self, table: TopDown) -> tuple[slice, slice] | None:
        """Return the rows and columns of all that may stand on the table or hang over it; None if nothing is there."""
        points = self.points[:: TABLE_VIEW.stride, :: TABLE_VIEW.stride]
        v, u = np.nonzero((points[..., 2] > -TABLE_VIEW.below_m) & (points[..., 2] < TABLE_VIEW.highest_m))
        near = np.isfinite(table.distance(points[v, u]))
        if not near.any():
            return None
        spans = ((int(k[near].min()), int(k[near].max())) for k in (v, u))
        rows, columns = (
            slice(max(0, TABLE_VIEW.stride * (low - 2)), TABLE_VIEW.stride * (high + 3)) for low, high in spans
        )
        return rows, columns


def view_table(
    depth: DepthImage,
    camera: PinholeCamera,
    camera_in_base: FloatArray | None,
    *,
    options: TableViewOptions = TABLE_VIEW,
) -> TableView:
    """Find the table in a depth image (H, W) [m], in the base frame if the camera's pose (4, 4) in it is known.

    Raises:
        TableNotFoundError: no table is seen.
    """
    known = camera_in_base is not None
    pose = camera_in_base if camera_in_base is not None else np.eye(4)
    depth = without_flying(without_pinholes(np.where(depth > 0.0, depth, np.float32(np.nan))), camera.fx)
    up = np.array([0.0, 0.0, 1.0]) if known else np.array([0.0, -0.8, -0.6])
    plane = find_table_plane(_sparse_points(depth, camera, pose, options=options), up, gravity_known=known)
    ground = ground_frame(plane, gravity_known=known)
    points = ground.project(depth, camera, pose)
    height = cv2.extractChannel(points, 2)
    on_table = table_pixels(height, plane.sigma_m)
    if not on_table.any():
        raise TableNotFoundError("no table seen: the surface found is too small")
    curved = bow(height, on_table)
    if curved is not None:
        height -= curved
        points[..., 2] = height
        on_table = table_pixels(height, plane.sigma_m)
    surface, outline = find_table(points, on_table, ground, camera, invert(pose))
    pixel_m = quantile(depth[::3, ::3][on_table[::3, ::3]], 50) / camera.fx
    viewer = (ground.to_ground @ pose)[:3, 3]
    away = depth * _ray_lengths(camera)
    return TableView(ground, points, on_table, surface, outline, depth, away, pixel_m, viewer)


@functools.lru_cache(maxsize=4)
def _ray_lengths(camera: PinholeCamera) -> DepthImage:
    """Return how long the ray of each pixel (H, W) is at a depth of 1."""
    u = (np.arange(camera.width) - camera.cx) / camera.fx
    v = (np.arange(camera.height) - camera.cy) / camera.fy
    return np.sqrt(1.0 + u[None] ** 2 + v[:, None] ** 2).astype(np.float32)


def _sparse_points(
    depth: DepthImage, camera: PinholeCamera, pose: FloatArray, *, options: TableViewOptions = TABLE_VIEW
) -> FloatArray:
    """Return some points of some rows (N, 3) that are known, in the frame of the camera's pose."""
    z = depth[:: options.stride, :: options.stride].astype(float)
    v, u = np.nonzero(np.isfinite(z))
    optical = camera.deproject(np.column_stack([u, v]) * float(options.stride), z[v, u])
    return np.asarray(optical @ pose[:3, :3].T + pose[:3, 3])
