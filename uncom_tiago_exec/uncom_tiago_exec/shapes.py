# SPDX-License-Identifier: Apache-2.0
"""What an object is for the hand: its visible points completed by symmetry, its outline, its opening if it is hollow.

Nothing here knows kinds of objects. Round things are completed by turning their visible profile about their axis,
others by filling the space between what is seen and the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from uncom_perception.types import Detection

from uncom_tiago_exec.circles import Circle, fit_rim, fit_round
from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.types import FloatArray

VOXEL = 0.004  # [m]


@dataclass(frozen=True, slots=True)
class Rim:
    """The edge of an opening: centre (2,), outer radius, height of the edge and of the floor inside [m]."""

    centre: FloatArray
    radius: float
    z: float
    floor_z: float


@dataclass(frozen=True, slots=True)
class ObjectShape:
    """One thing on the table, in base_footprint [m].

    points (N, 3): completed surface; visible (M, 3): what was seen; centre (2,) and yaw, size (3,) of its upright
    oriented box; bottom and top heights; axis: the circle of its footprint if it is round; rim if it is hollow.
    """

    name: str
    points: FloatArray
    visible: FloatArray
    centre: FloatArray
    yaw: float
    size: FloatArray
    bottom: float
    top: float
    axis: Circle | None
    rim: Rim | None

    @property
    def height(self) -> float:
        """Height above the table [m]."""
        return self.top - self.bottom

    @property
    def middle(self) -> FloatArray:
        """Centre of the body (3,): of its round part where it has one."""
        xy = self.axis.centre if self.axis is not None else self.centre
        return np.array([xy[0], xy[1], 0.5 * (self.bottom + self.top)])


def shape_of(detection: Detection, table_z: float) -> ObjectShape:
    """Complete a detection that stands on a table at height table_z [m].

    Raises:
        RefusedError: the detection has no geometry.
    """
    if detection.geometry is None:
        raise RefusedError(f"I do not see how far away the {detection.label or 'object'} is")
    name = detection.label or detection.id
    cloud = np.asarray(detection.geometry.cloud, dtype=float).reshape(-1, 3)
    cloud = _clean(cloud[np.isfinite(cloud).all(axis=1)], table_z)
    if len(cloud) < 12:
        cloud = _box_points(detection.geometry.pose, np.maximum(detection.geometry.size, 0.004))
    return complete(name, cloud, table_z)


def complete(name: str, cloud: FloatArray, table_z: float) -> ObjectShape:
    """Complete visible points (N, 3) of one thing that stands at height table_z [m]."""
    visible = thin(cloud, VOXEL)
    top = max(float(np.quantile(visible[:, 2], 0.995)), table_z + 0.003)
    rim_circle = fit_rim(visible, table_z)
    rim: Rim | None = None
    if rim_circle is not None:
        inside = np.linalg.norm(visible[:, :2] - rim_circle.centre, axis=1) < 0.6 * rim_circle.radius
        below = visible[inside, 2]
        low = float(np.quantile(below, 0.05)) if len(below) > 5 else table_z + 0.006
        rim_points = np.abs(np.linalg.norm(visible[:, :2] - rim_circle.centre, axis=1) - rim_circle.radius) < 0.008
        edge = float(np.quantile(visible[rim_points, 2], 0.9)) if rim_points.any() else top
        rim = Rim(rim_circle.centre, rim_circle.radius, edge, min(low, edge - 0.005))
    axis = rim_circle or fit_round(visible, table_z)
    points = _revolve(visible, axis, rim is None, table_z) if axis is not None else _fill(visible, table_z)
    centre, yaw, extent = smallest_rectangle(points[:, :2])
    size = np.array([extent[0], extent[1], top - table_z])
    return ObjectShape(name, points, visible, centre, yaw, size, table_z, top, axis, rim)


def thin(points: FloatArray, voxel: float) -> FloatArray:
    """Keep one point (their mean) of each cube of side `voxel` [m]."""
    if len(points) == 0:
        return points
    cells = np.floor(points / voxel).astype(np.int64)
    cells -= cells.min(axis=0)
    size = cells.max(axis=0) + 1
    _, index = np.unique((cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2], return_inverse=True)
    count = np.bincount(index)
    return np.column_stack([np.bincount(index, weights=points[:, i]) / count for i in range(3)])


def smallest_rectangle(points: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """Return centre (2,), yaw of the long side [rad], extents (long, short) of the smallest rectangle around (N, 2)."""
    if len(points) == 0:
        raise RefusedError("an object without points cannot be handled")
    points = _outer(points)
    coarse = _upright_rectangle(points, np.radians(np.arange(0.0, 90.0, 4.0)))
    _, yaw, centre, extent = _upright_rectangle(points, coarse[1] + np.radians(np.arange(-4.0, 4.01, 0.5)))
    if extent[1] > extent[0]:
        yaw, extent = yaw + np.pi / 2.0, extent[::-1]
    return centre, float((yaw + np.pi / 2.0) % np.pi - np.pi / 2.0), np.maximum(extent, 0.003)


def _outer(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points (N, 2), or the points where there is none."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points


def _upright_rectangle(points: FloatArray, angles: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
    """Return area, angle, centre (2,) and extents (2,) of the smallest rectangle among those turned by angles (K,)."""
    cos, sin = np.cos(angles), np.sin(angles)
    turns = np.stack([np.stack([cos, sin], axis=1), np.stack([-sin, cos], axis=1)], axis=1)
    local = np.einsum("kij,nj->kni", turns, points)
    low, high = local.min(axis=1), local.max(axis=1)
    areas = np.prod(np.maximum(high - low, 1e-4), axis=1)
    k = int(areas.argmin())
    return float(areas[k]), float(angles[k]), turns[k].T @ (0.5 * (low[k] + high[k])), high[k] - low[k]


def _clean(cloud: FloatArray, table_z: float) -> FloatArray:
    """Drop what lies under the table and lone points far from the rest."""
    cloud = cloud[(cloud[:, 2] > table_z - 0.01) & (cloud[:, 2] < table_z + 0.6)]
    if len(cloud) < 30:
        return cloud
    low, high = np.quantile(cloud, 0.01, axis=0), np.quantile(cloud, 0.99, axis=0)
    slack = 0.25 * (high - low) + 0.006
    return cloud[((cloud >= low - slack) & (cloud <= high + slack)).all(axis=1)]


def _revolve(visible: FloatArray, axis: Circle, solid: bool, table_z: float) -> FloatArray:
    """Turn the visible profile about the axis; parts beyond the radius (handles) stay as seen."""
    offset = visible[:, :2] - axis.centre
    radius = np.linalg.norm(offset, axis=1)
    body = radius <= axis.radius + 0.006
    profile = thin(np.column_stack([radius[body], np.zeros(body.sum()), visible[body, 2]]), VOXEL)
    if solid and len(profile):  # the underside cannot be seen: straight down from the widest place
        widest = float(profile[:, 0].max())
        lowest = float(profile[profile[:, 0] > widest - 0.008, 2].min())
        down = np.arange(table_z, lowest, 0.006)
        profile = np.vstack([profile, np.column_stack([np.full(len(down), widest), np.zeros_like(down), down])])
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turned = (axis.centre + profile[:, None, :1] * ring[None]).reshape(-1, 2)
    heights = np.repeat(profile[:, 2], len(angles))
    return np.vstack([thin(np.column_stack([turned, heights]), VOXEL), visible[~body]])


def _fill(visible: FloatArray, table_z: float) -> FloatArray:
    """Add points straight down to the table."""
    layers = [visible]
    top = float(visible[:, 2].max())
    for level in np.linspace(table_z + 0.002, top, min(16, 2 + int((top - table_z) / 0.008)), endpoint=False):
        above = visible[visible[:, 2] > level + 0.004]
        layers.append(np.column_stack([above[:, :2], np.full(len(above), level)]))
    return thin(np.vstack(layers), VOXEL)


def _box_points(pose: FloatArray, size: FloatArray) -> FloatArray:
    """Return points on the surface of a box."""
    axes = [np.linspace(-0.5, 0.5, max(2, int(np.ceil(s / VOXEL)))) * s for s in size]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = (np.abs(np.abs(grid) - size / 2.0) < 1e-6).any(axis=1)
    return np.asarray(grid[edge] @ pose[:3, :3].T + pose[:3, 3])
