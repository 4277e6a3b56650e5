# SPDX-License-Identifier: Apache-2.0
"""An object in space: its cloud and its oriented box."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.transforms import apply, invert

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.attributes.options import OBJECT_GEOMETRY, ObjectGeometryOptions
from uncom_perception.objects.table.table_outline import Ground
from uncom_perception.types import LEAST_CORNERS, Geometry, Mask

FloatArray = npt.NDArray[np.float64]
PointImage = npt.NDArray[np.float32]
Outline = npt.NDArray[np.float32]


def clean_points(
    ground_points: PointImage, mask: Mask, *, options: ObjectGeometryOptions = OBJECT_GEOMETRY
) -> npt.NDArray[np.float32]:
    """Return an object's points (N, 3) on the ground, without the flying ones that depth cameras see at edges."""
    pixels = np.flatnonzero(mask)
    pixels = pixels[:: 1 + len(pixels) // options.max_points]
    points = ground_points.reshape(-1, 3)[pixels]
    points = points[points[:, 2] > options.lowest_m]  # which drops the unknown ones, too
    if len(points) < options.few_points:
        return points
    key = _cell_keys(points, options.crowd_cell_m)
    count = np.bincount(key)
    kept = points[count[key] >= options.least_crowd]
    if len(kept) <= 0.5 * len(points):
        return points
    return _without_trail(_without_strays(kept, options=options), options=options)


def _without_strays(
    points: npt.NDArray[np.float32], *, options: ObjectGeometryOptions = OBJECT_GEOMETRY
) -> npt.NDArray[np.float32]:
    """Drop the few points (N, 3) that lie apart from the rest, seen from above."""
    column, row = (
        ((points[:, k] - points[:, k].min()) * np.float32(1.0 / options.piece_gap_m)).astype(np.int32) for k in (0, 1)
    )
    filled = np.zeros((int(row.max()) + 1, int(column.max()) + 1), np.uint8)
    filled[row, column] = 1
    count, labels = cv2.connectedComponents(filled, connectivity=8)
    if count - 1 <= 1:
        return points
    piece = labels[row, column]
    kept: npt.NDArray[np.bool_] = np.bincount(piece)[piece] >= options.stray_share * len(points)
    return points[kept]


def _without_trail(
    points: npt.NDArray[np.float32], *, options: ObjectGeometryOptions = OBJECT_GEOMETRY
) -> npt.NDArray[np.float32]:
    """Drop the points (N, 3) that trail along the table behind a tall object, where its edge is smeared."""
    height = quantile(points[:, 2], 98)
    low = points[:, 2] < max(options.trail_height_m, options.trail_height_share * height)
    if height < options.tall_m or not low.any() or np.count_nonzero(low) > 0.5 * len(points):
        return points
    lower, upper = points[low, :2], points[~low]
    if (lower.max(axis=0) < upper[:, :2].max(axis=0) + options.trail_reach_m).all() and (
        lower.min(axis=0) > upper[:, :2].min(axis=0) - options.trail_reach_m
    ).all():
        return points
    corners = convex_outline(upper)[:, 0].astype(float)
    if len(corners) < LEAST_CORNERS:
        return points
    edges = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([edges[:, 1], -edges[:, 0]]) / np.maximum(np.hypot(edges[:, 0], edges[:, 1]), 1e-9)
    turn = np.sign(np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - np.roll(corners[:, 0], -1) * corners[:, 1]))
    beyond = turn * (lower @ outward - np.sum(corners.T * outward, axis=0))
    drop = np.zeros(len(points), bool)
    drop[low] = beyond.max(axis=1) > options.trail_reach_m
    return points[~drop]


def convex_outline(points: npt.NDArray[np.float32]) -> Outline:
    """Return the corners (M, 1, 2) of the convex outline of points (N, 3) seen from above [m]."""
    return np.asarray(cv2.convexHull(np.ascontiguousarray(points[:, :2])), dtype=np.float32)


def support_heights(clouds: Sequence[npt.NDArray[np.float32]], hulls: Sequence[Outline]) -> list[float]:
    """Return the height at which each object stands: 0, or the floor of what it lies in or on.

    Objects are given by points (N, 3) and convex outlines.
    """
    areas = [cv2.contourArea(hull) for hull in hulls]
    floors = [quantile(cloud[:, 2], 5) for cloud in clouds]
    heights = [0.0] * len(clouds)
    for i, cloud in enumerate(clouds):
        middle = tuple(float(v) for v in cloud[:, :2].mean(axis=0))
        for j, hull in enumerate(hulls):
            inside = i != j and areas[j] > 1.3 * areas[i] and cv2.pointPolygonTest(hull, middle, False) > 0
            if inside and floors[i] > floors[j] + 0.003:
                heights[i] = max(heights[i], min(floors[j], floors[i]))
    return heights


def geometry(
    ground_points: npt.NDArray[np.float32],
    ground: Ground,
    base_m: float = 0.0,
    hull: Outline | None = None,
    *,
    options: ObjectGeometryOptions = OBJECT_GEOMETRY,
) -> Geometry:
    """Return cloud, oriented box and centroid in the frame that the ground lies in.

    The box is turned about the ground's vertical only and stands at base_m above the ground; its first axis is the
    longer one. The hull is the convex outline of the points, if it is known.
    The centroid is the box's centre, which one-sided views shift less than the mean of the visible points.
    """
    keys = _cell_keys(ground_points, options.voxel_m)
    first = np.full(int(keys.max()) + 1, -1, np.int32)
    first[keys[::-1]] = np.arange(len(keys) - 1, -1, -1, dtype=np.int32)  # of several the first stays
    cloud = ground_points[first[keys] == np.arange(len(keys))]
    to_frame = invert(ground.to_ground)
    (x, y), (a, b), angle = cv2.minAreaRect(hull if hull is not None else convex_outline(ground_points))
    if b > a:
        a, b, angle = b, a, angle + 90.0
    yaw = np.radians((angle + 90.0) % 180.0 - 90.0)
    height = quantile(ground_points[:, 2], 99.0)
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    middle = (base_m + height) / 2.0
    pose[:3, 3] = (x, y, middle)
    pose = to_frame @ pose
    # Heights are over the plane; where the ground frame is level and the plane is not quite, correct the centre.
    pose[:3, 3] += (ground.plane.offset + middle - ground.plane.normal @ pose[:3, 3]) * ground.plane.normal
    in_frame = apply(to_frame, cloud)
    lift = ground.plane.offset + cloud[:, 2] - in_frame @ ground.plane.normal
    in_frame = in_frame + lift[:, None] * ground.plane.normal
    return Geometry(pose[:3, 3].copy(), pose, np.array([a, b, height - base_m]), in_frame.astype(np.float32))


def _cell_keys(points: npt.NDArray[np.float32], cell_m: float) -> npt.NDArray[np.int32]:
    """Return a number for the cell of space that each point (N, 3) lies in."""
    key = np.zeros(len(points), np.int32)
    for axis in range(3):
        values = points[:, axis]
        cells = ((values - values.min()) * np.float32(1.0 / cell_m) + np.float32(0.5)).astype(np.int32)
        key *= int(cells.max()) + 1
        key += cells
    return key
