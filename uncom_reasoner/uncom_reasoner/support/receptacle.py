# SPDX-License-Identifier: Apache-2.0
"""Where on a receiving object another one is put: the middle of its opening or top, from its points.

Which objects are containers is decided elsewhere: grounding/target_resolution.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from shapely.geometry import Point, Polygon
from uncom_common.transforms import FloatArray
from uncom_perception.types import Detection

from uncom_reasoner.support.options import RECEPTACLE, SURFACE, ReceptacleOptions
from uncom_reasoner.support.support_plane import Surface, compute_footprint, find_centre


@dataclass(frozen=True, slots=True)
class Opening:
    """The largest disc in an object seen from above, plane units.

    Centre (2,), radius, height of what lies in it above the support, and how far that is below the object's rim.
    """

    centre: FloatArray
    radius: float
    height: float
    depth: float


def find_opening(detection: Detection, surface: Surface, options: ReceptacleOptions = RECEPTACLE) -> Opening:
    """Find the middle of a container's opening or of a top: handles and spouts are too thin to count.

    Without depth it is the middle of the outline, at height 0.
    """
    geometry = detection.geometry
    shape = compute_footprint(detection, surface)
    if not surface.metric or geometry is None or len(geometry.cloud) < SURFACE.min_cloud_points:
        centre = find_centre(shape) if not shape.is_empty else np.array(detection.box.center)
        return Opening(centre, float(np.sqrt(max(shape.area, 0.0) / np.pi)), 0.0, 0.0)
    points = surface.to_plane(geometry.cloud)
    centre, radius = _find_largest_disc(points[:, :2], options)
    near = max(options.near_share * radius, options.near_pixels * options.raster_m)
    heights = points[np.linalg.norm(points[:, :2] - centre, axis=1) <= near, 2]
    height = float(np.median(heights)) if len(heights) else float(points[:, 2].max())
    depth = float(np.percentile(points[:, 2], options.rim_percentile)) - height
    return Opening(centre, radius, max(height, 0.0), max(depth, 0.0))


def _find_largest_disc(points: FloatArray, options: ReceptacleOptions) -> tuple[FloatArray, float]:
    """Return centre (2,) and radius of the largest disc within points (N, 2) seen from above."""
    raster = options.raster_m
    low = points.min(axis=0) - 4.0 * raster
    index = np.floor((points - low) / raster).astype(int)
    shape = index.max(axis=0) + 5
    grid = np.zeros(shape, dtype=bool)
    grid[index[:, 0], index[:, 1]] = True
    # The far inner wall hides part of the bottom, and voxel filtering leaves gaps: close them, then fill holes.
    filled = ndimage.binary_fill_holes(ndimage.binary_closing(grid, iterations=options.closing_rounds))
    distance = ndimage.distance_transform_edt(filled)
    best = np.argwhere(distance >= options.disc_share * distance.max()).mean(axis=0)
    return low + (best + 0.5) * raster, float(distance.max()) * raster


def find_receiving_outline(detection: Detection, surface: Surface, options: ReceptacleOptions = RECEPTACLE) -> Polygon:
    """Return the receiving area: the disc of the opening within the object's outline."""
    opening = find_opening(detection, surface, options)
    shape = compute_footprint(detection, surface)
    disc = Point(*opening.centre).buffer(max(opening.radius, options.min_radius))
    common = disc.intersection(shape)
    return common if isinstance(common, Polygon) and not common.is_empty else shape


def fits_in(moved: Detection, container: Detection, surface: Surface, options: ReceptacleOptions = RECEPTACLE) -> bool:
    """Whether an object can go into a container: its middle extent against the opening, with room for errors."""
    if moved.geometry is None or container.geometry is None or not surface.metric:
        return True
    extents = np.sort(moved.geometry.size)
    width = 2.0 * find_opening(container, surface, options).radius
    return bool(extents[1] <= options.fit_factor * width + options.fit_margin_m)
