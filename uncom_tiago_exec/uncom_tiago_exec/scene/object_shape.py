# SPDX-License-Identifier: Apache-2.0
"""What an object is for the hand: its visible points completed by symmetry, its outline, its opening if it is hollow.

Nothing here knows kinds of objects. Round things are completed by turning their visible profile about their axis,
others by filling the space between what is seen and the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from uncom_perception.types import Detection

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.scene.circle_fitting import Circle, fit_rim, fit_round
from uncom_tiago_exec.types import FloatArray

VOXEL = 0.004  # [m]
_AROUND = np.ones((3, 3), dtype=np.uint8)
_UNEVEN, _BULGE = 0.002, 0.006  # [m] beyond the radius of its footprint: of anything round, and of bellies
_SECTORS, _LEVEL = 24, 0.012  # directions, and heights [m], in which a belly is told from a handle:
_BELLY = 5  # it is seen in so many directions at least


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
    origin = points.mean(axis=0)
    centre, extent, angle = cv2.minAreaRect((points - origin).astype(np.float32))
    yaw, (long, short) = float(np.radians(angle)), extent
    if short > long:
        yaw, long, short = yaw + np.pi / 2.0, short, long
    yaw = float((yaw + np.pi / 2.0) % np.pi - np.pi / 2.0)
    return np.asarray(origin + centre), yaw, np.maximum([long, short], 0.003)


def _clean(cloud: FloatArray, table_z: float) -> FloatArray:
    """Drop what lies under the table and lone points far from the rest."""
    cloud = cloud[(cloud[:, 2] > table_z - 0.01) & (cloud[:, 2] < table_z + 0.6)]
    if len(cloud) < 30:
        return cloud
    low, high = np.quantile(cloud, (0.01, 0.99), axis=0)
    slack = 0.25 * (high - low) + 0.006
    return np.asarray(cloud[((cloud >= low - slack) & (cloud <= high + slack)).all(axis=1)])


def _revolve(visible: FloatArray, axis: Circle, solid: bool, table_z: float) -> FloatArray:
    """Turn the visible profile about the axis; parts beyond the radius (handles) stay as seen."""
    offset = visible[:, :2] - axis.centre
    radius = np.linalg.norm(offset, axis=1)
    body = (radius <= axis.radius + _UNEVEN) | _bulging(offset, radius, visible[:, 2], axis.radius)
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


def _bulging(offset: FloatArray, radius: FloatArray, heights: FloatArray, usual: float) -> npt.NDArray[np.bool_]:
    """Tell which points (N,) lie a little beyond the usual radius [m], if so in many directions at their height.

    A belly does; the root of a handle does in few directions, and must not widen the whole thing when it is turned.
    """
    beyond = (radius > usual + _UNEVEN) & (radius <= usual + _BULGE)
    sector = np.floor((np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * np.pi) + 0.5) * _SECTORS) % _SECTORS
    level = np.floor((heights - heights.min()) / _LEVEL).astype(np.intp)
    cells = np.unique(level[beyond] * _SECTORS + sector[beyond].astype(np.intp))
    directions = np.bincount(cells // _SECTORS, minlength=int(level.max()) + 1)
    return np.asarray(beyond & (directions >= _BELLY)[level])


def _fill(visible: FloatArray, table_z: float) -> FloatArray:
    """Add a wall straight down to the table under the outline of what is seen, and a bottom."""
    cells = np.floor(visible[:, :2] / VOXEL).astype(np.intp)
    cells -= cells.min(axis=0) - 1
    size = tuple(cells.max(axis=0) + 2)
    layers = [visible]
    top = float(visible[:, 2].max())
    levels = np.linspace(table_z + 0.002, top, min(16, 2 + int((top - table_z) / 0.008)), endpoint=False)
    for level in levels:
        above = visible[:, 2] > level + 0.004
        if level > levels[0]:
            covered = np.zeros(size, dtype=np.uint8)
            covered[tuple(cells[above].T)] = 1
            inner = cv2.erode(cv2.morphologyEx(covered, cv2.MORPH_CLOSE, _AROUND), _AROUND)
            above &= inner[tuple(cells.T)] == 0
        layers.append(np.column_stack([visible[above, :2], np.full(int(np.count_nonzero(above)), level)]))
    return thin(np.vstack(layers), VOXEL)


def _box_points(pose: FloatArray, size: FloatArray) -> FloatArray:
    """Return points on the surface of a box."""
    axes = [np.linspace(-0.5, 0.5, max(2, int(np.ceil(s / VOXEL)))) * s for s in size]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = (np.abs(np.abs(grid) - size / 2.0) < 1e-6).any(axis=1)
    return np.asarray(grid[edge] @ pose[:3, :3].T + pose[:3, 3])
