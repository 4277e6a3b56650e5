# SPDX-License-Identifier: Apache-2.0
"""A depth image seen from the table: the plane, its outline, and every pixel's place over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import invert

from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.objects.detector import DepthImage, FloatArray
from uncom_perception.objects.flying import without_flying
from uncom_perception.objects.level import bow
from uncom_perception.objects.plane import find_table_plane
from uncom_perception.objects.table import Ground, PointImage, find_table, ground_frame, table_pixels
from uncom_perception.types import Mask, TableSurface

_STRIDE = 4


@dataclass(frozen=True, slots=True)
class TableView:
    """What a depth image says about the table.

    Points (H, W, 3) are x, y on the table and height above it [m]; the viewer (3,) is where the camera is in the same
    frame; the outline (N, 2) is that of the table top [m].
    """

    ground: Ground
    points: PointImage
    on_table: Mask
    surface: TableSurface
    outline: FloatArray
    depth: DepthImage
    pixel_m: float
    viewer: FloatArray


def view_table(depth: DepthImage, camera: PinholeCamera, camera_in_base: FloatArray | None) -> TableView:
    """Find the table in a depth image (H, W) [m], in the base frame if the camera's pose (4, 4) in it is known.

    Raises:
        TableNotFoundError: no table is seen.
    """
    known = camera_in_base is not None
    pose = camera_in_base if camera_in_base is not None else np.eye(4)
    depth = without_flying(np.where(depth > 0.0, depth, np.float32(np.nan)), camera.fx)
    up = np.array([0.0, 0.0, 1.0]) if known else np.array([0.0, -0.8, -0.6])
    plane = find_table_plane(_sparse_points(depth, camera, pose), up, gravity_known=known)
    ground = ground_frame(plane, gravity_known=known)
    points = ground.project(depth, camera, pose)
    on_table = table_pixels(points[..., 2], plane.sigma_m)
    if not on_table.any():
        raise TableNotFoundError("no table seen: the surface found is too small")
    curved = bow(points[..., 2], on_table)
    if curved is not None:
        points[..., 2] -= curved
        on_table = table_pixels(points[..., 2], plane.sigma_m)
    surface, outline = find_table(points, on_table, ground, camera, invert(pose))
    pixel_m = float(np.median(depth[on_table][::50])) / camera.fx
    viewer = (ground.to_ground @ pose)[:3, 3]
    return TableView(ground, points, on_table, surface, outline, depth, pixel_m, viewer)


def _sparse_points(depth: DepthImage, camera: PinholeCamera, pose: FloatArray) -> FloatArray:
    """Return every fourth point of every fourth row (N, 3) that is known, in the frame of the camera's pose."""
    z = depth[::_STRIDE, ::_STRIDE].astype(float)
    v, u = np.nonzero(np.isfinite(z))
    optical = camera.deproject(np.column_stack([u, v]) * float(_STRIDE), z[v, u])
    return np.asarray(optical @ pose[:3, :3].T + pose[:3, 3])
