# SPDX-License-Identifier: Apache-2.0
"""Where on a receiving thing another one is put: the middle of its opening or top, from its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from shapely.geometry import Point, Polygon
from uncom_perception.types import Detection

from uncom_reasoner.support.support_plane import LEAST_POINTS, Surface, centre_of, footprint
from uncom_reasoner.types import FloatArray

RASTER_M = 0.005


@dataclass(frozen=True, slots=True)
class Opening:
    """The largest disc in a thing seen from above, plane units.

    Centre (2,), radius, height of what lies in it, and how far that is below the thing's highest points.
    """

    centre: FloatArray
    radius: float
    height: float
    depth: float


def opening_of(detection: Detection, surface: Surface) -> Opening:
    """Find the middle of a container's opening or of a top: handles and spouts are too thin to count."""
    geometry = detection.geometry
    shape = footprint(detection, surface)
    if not surface.metric or geometry is None or len(geometry.cloud) < LEAST_POINTS:
        centre = centre_of(shape) if not shape.is_empty else np.array(detection.box.center)
        return Opening(centre, float(np.sqrt(max(shape.area, 0.0) / np.pi)), 0.0, 0.0)
    points = surface.to_plane(geometry.cloud)
    centre, radius = _largest_disc(points[:, :2])
    near = points[np.linalg.norm(points[:, :2] - centre, axis=1) <= max(0.5 * radius, 2.0 * RASTER_M)]
    height = float(np.median(near[:, 2])) if len(near) else float(points[:, 2].max())
    depth = float(np.percentile(points[:, 2], 95)) - height
    return Opening(centre, radius, max(height, 0.0), max(depth, 0.0))


def _largest_disc(points: FloatArray) -> tuple[FloatArray, float]:
    low = points.min(axis=0) - 4.0 * RASTER_M
    index = np.floor((points - low) / RASTER_M).astype(int)
    shape = index.max(axis=0) + 5
    grid = np.zeros(shape, dtype=bool)
    grid[index[:, 0], index[:, 1]] = True
    # The far inner wall hides part of the bottom, and voxel filtering leaves gaps: close them, then fill holes.
    filled = ndimage.binary_fill_holes(ndimage.binary_closing(grid, iterations=3))
    distance = ndimage.distance_transform_edt(filled)
    best = np.argwhere(distance >= 0.95 * distance.max()).mean(axis=0)
    return low + (best + 0.5) * RASTER_M, float(distance.max()) * RASTER_M


def outline_of(detection: Detection, surface: Surface) -> Polygon:
    """Return the receiving area: the disc of the opening within the thing's outline."""
    opening = opening_of(detection, surface)
    shape = footprint(detection, surface)
    disc = Point(*opening.centre).buffer(max(opening.radius, 1e-3))
    common = disc.intersection(shape)
    return common if isinstance(common, Polygon) and not common.is_empty else shape


def fits_in(moved: Detection, container: Detection, surface: Surface) -> bool:
    """Whether a thing can go into a container: its middle extent against the opening, with room for errors of sight."""
    if moved.geometry is None or container.geometry is None or not surface.metric:
        return True
    extents = np.sort(moved.geometry.size)
    return bool(extents[1] <= 1.5 * 2.0 * opening_of(container, surface).radius + 0.01)
