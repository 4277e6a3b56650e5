# SPDX-License-Identifier: Apache-2.0
"""What an object is for the hand: its visible points completed by symmetry, its outline, its opening if it is hollow.

Nothing here knows kinds of objects. Round objects are completed by turning their visible profile about their axis,
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
from uncom_tiago_exec.scene.options import RIM, SHAPE_COMPLETION, RimOptions, ShapeCompletionOptions
from uncom_tiago_exec.types import FloatArray

_EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class Rim:
    """The edge of an opening: centre (2,), outer radius, height of the edge and of the floor inside [m]."""

    centre: FloatArray
    radius: float
    z: float
    floor_z: float


@dataclass(frozen=True, slots=True)
class ObjectShape:
    """One object on the table, in base_footprint [m].

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


def complete_detection(
    detection: Detection, table_z: float, options: ShapeCompletionOptions = SHAPE_COMPLETION, rims: RimOptions = RIM
) -> ObjectShape:
    """Complete a detection that stands on a table at height table_z [m].

    Raises:
        RefusedError: the detection has no geometry.
    """
    if detection.geometry is None:
        raise RefusedError(f"I do not see how far away the {detection.label or 'object'} is")
    name = detection.label or detection.id
    cloud = np.asarray(detection.geometry.cloud, dtype=float).reshape(-1, 3)
    cloud = _without_outliers(cloud[np.isfinite(cloud).all(axis=1)], table_z, options)
    if len(cloud) < options.least_points:
        size = np.maximum(detection.geometry.size, options.least_size_m)
        cloud = _box_points(detection.geometry.pose, size, options.voxel_m)
    return complete_shape(name, cloud, table_z, options, rims)


def complete_shape(
    name: str,
    cloud: FloatArray,
    table_z: float,
    options: ShapeCompletionOptions = SHAPE_COMPLETION,
    rims: RimOptions = RIM,
) -> ObjectShape:
    """Complete visible points (N, 3) of one object that stands at height table_z [m]."""
    visible = downsample(cloud, options.voxel_m)
    top = max(float(np.quantile(visible[:, 2], options.top_quantile)), table_z + options.least_height_m)
    rim_circle = fit_rim(visible, table_z, rims)
    rim = None if rim_circle is None else _rim(visible, rim_circle, top, table_z, rims)
    axis = rim_circle or fit_round(visible, table_z)
    if axis is not None:
        points = _revolve(visible, axis, table_z, options, solid=rim is None)
    else:
        points = _fill(visible, table_z, options)
    centre, yaw, extent = smallest_rectangle(points[:, :2])
    size = np.array([extent[0], extent[1], top - table_z])
    return ObjectShape(name, points, visible, centre, yaw, size, table_z, top, axis, rim)


def _rim(visible: FloatArray, circle: Circle, top: float, table_z: float, options: RimOptions) -> Rim:
    """Measure the height of an opening's edge, and of the floor in it, in visible points (N, 3)."""
    away = np.linalg.norm(visible[:, :2] - circle.centre, axis=1)
    below = visible[away < options.floor_inside_share * circle.radius, 2]
    enough = len(below) > options.least_floor_points
    low = float(np.quantile(below, options.floor_quantile)) if enough else table_z + options.unseen_floor_m
    at_edge = np.abs(away - circle.radius) < options.edge_width_m
    edge = float(np.quantile(visible[at_edge, 2], options.edge_quantile)) if at_edge.any() else top
    return Rim(circle.centre, circle.radius, edge, min(low, edge - options.least_depth_m))


def downsample(points: FloatArray, voxel: float) -> FloatArray:
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


def _without_outliers(cloud: FloatArray, table_z: float, options: ShapeCompletionOptions) -> FloatArray:
    """Drop points (N, 3) under the table, and lone ones far from the rest."""
    lowest, highest = table_z - options.below_table_m, table_z + options.most_height_m
    cloud = cloud[(cloud[:, 2] > lowest) & (cloud[:, 2] < highest)]
    if len(cloud) < options.least_clean_points:
        return cloud
    low, high = np.quantile(cloud, options.clean_quantiles, axis=0)
    slack = options.clean_share * (high - low) + options.clean_slack_m
    return np.asarray(cloud[((cloud >= low - slack) & (cloud <= high + slack)).all(axis=1)])


def _revolve(
    visible: FloatArray, axis: Circle, table_z: float, options: ShapeCompletionOptions, *, solid: bool
) -> FloatArray:
    """Turn the visible profile about the axis; parts beyond the radius (handles) stay as seen.

    The underside of what is solid cannot be seen: it goes straight down from the widest place.
    """
    voxel = options.voxel_m
    offset = visible[:, :2] - axis.centre
    radius = np.linalg.norm(offset, axis=1)
    bulging = _bulging(offset, radius, visible[:, 2], axis.radius, options)
    body = (radius <= axis.radius + options.uneven_m) | bulging
    profile = downsample(np.column_stack([radius[body], np.zeros(body.sum()), visible[body, 2]]), voxel)
    if solid and len(profile):
        widest = float(profile[:, 0].max())
        lowest = float(profile[profile[:, 0] > widest - options.widest_m, 2].min())
        down = np.arange(table_z, lowest, options.underside_step_m)
        profile = np.vstack([profile, np.column_stack([np.full(len(down), widest), np.zeros_like(down), down])])
    angles = np.linspace(0.0, 2.0 * np.pi, options.turns, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turned = (axis.centre + profile[:, None, :1] * ring[None]).reshape(-1, 2)
    heights = np.repeat(profile[:, 2], len(angles))
    return np.vstack([downsample(np.column_stack([turned, heights]), voxel), visible[~body]])


def _bulging(
    offset: FloatArray, radius: FloatArray, heights: FloatArray, usual: float, options: ShapeCompletionOptions
) -> npt.NDArray[np.bool_]:
    """Tell which points (N,) lie a little beyond the usual radius [m], if so in many directions at their height.

    A belly does; the root of a handle does in few directions, and must not widen the whole object when it is turned.
    """
    sectors = options.belly_sectors
    beyond = (radius > usual + options.uneven_m) & (radius <= usual + options.bulge_m)
    sector = np.floor((np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * np.pi) + 0.5) * sectors) % sectors
    level = np.floor((heights - heights.min()) / options.belly_level_m).astype(np.intp)
    cells = np.unique(level[beyond] * sectors + sector[beyond].astype(np.intp))
    directions = np.bincount(cells // sectors, minlength=int(level.max()) + 1)
    return np.asarray(beyond & (directions >= options.least_belly_sectors)[level])


def _fill(visible: FloatArray, table_z: float, options: ShapeCompletionOptions) -> FloatArray:
    """Add a wall straight down to the table under the outline of what is seen (N, 3), and a bottom."""
    cells = np.floor(visible[:, :2] / options.voxel_m).astype(np.intp)
    cells -= cells.min(axis=0) - 1
    size = tuple(cells.max(axis=0) + 2)
    layers = [visible]
    top = float(visible[:, 2].max())
    count = min(options.most_layers, 2 + int((top - table_z) / options.layer_m))
    levels = np.linspace(table_z + options.lowest_layer_m, top, count, endpoint=False)
    for level in levels:
        above = visible[:, 2] > level + options.above_layer_m
        if level > levels[0]:
            covered = np.zeros(size, dtype=np.uint8)
            covered[tuple(cells[above].T)] = 1
            inner = cv2.erode(cv2.morphologyEx(covered, cv2.MORPH_CLOSE, _EIGHT_NEIGHBOURS), _EIGHT_NEIGHBOURS)
            above &= inner[tuple(cells.T)] == 0
        layers.append(np.column_stack([visible[above, :2], np.full(int(np.count_nonzero(above)), level)]))
    return downsample(np.vstack(layers), options.voxel_m)


def _box_points(pose: FloatArray, size: FloatArray, spacing: float) -> FloatArray:
    """Return points (N, 3), `spacing` [m] apart, on the surface of a box with a pose (4, 4) and a size (3,) [m]."""
    axes = [np.linspace(-0.5, 0.5, max(2, int(np.ceil(s / spacing)))) * s for s in size]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = np.isclose(np.abs(grid), size / 2.0, rtol=0.0, atol=1e-6).any(axis=1)
    return np.asarray(grid[edge] @ pose[:3, :3].T + pose[:3, 3])
