# SPDX-License-Identifier: Apache-2.0
"""The support as a plane with its own coordinates, in metres with depth and in pixels without.

Metric plane coordinates are x away from the robot and y to its left, z upwards from the support; for a scene in the
base frame they are that frame's x and y. Without depth they are the image's u and v, and `unit` guesses pixels per
metre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiPoint, Polygon, box
from shapely.geometry.base import BaseGeometry
from uncom_common.options import ROBOT
from uncom_common.transforms import FloatArray, apply, invert
from uncom_perception.types import Detection, Scene, TableSurface

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.support.options import SURFACE, SurfaceOptions
from uncom_reasoner.types import View

POLYGON_CORNERS = 3  # a polygon has at least so many


@dataclass(frozen=True)
class Surface:
    """The support plane.

    Attributes:
        polygon: outline in plane coordinates; None where no table was seen.
        metric: whether plane coordinates are metres; else they are the image's pixels.
        units_per_m: plane units per metre: 1, or a guess without depth.
        right, far: unit directions (2,) to the right and away, as the chosen side sees them.
        scene_to_plane: (4, 4) from the scene's frame; identity without depth.
        shoulders: (x, y) of the shoulders; empty: unknown.
        reach_min, reach_max: between which distances from a shoulder an arm can place.
    """

    polygon: Polygon | None
    metric: bool
    units_per_m: float
    right: FloatArray
    far: FloatArray
    scene_to_plane: FloatArray
    shoulders: tuple[tuple[float, float], ...] = ()
    reach_min: float = 0.0
    reach_max: float = float("inf")

    def to_plane(self, points: npt.ArrayLike) -> FloatArray:
        """Map points (N, 3) of the scene's frame into plane coordinates (N, 3)."""
        return apply(self.scene_to_plane, points)

    def to_scene(self, points: npt.ArrayLike, z: float = 0.0) -> FloatArray:
        """Map plane points (N, 2) at a height z into the scene's frame (N, 3)."""
        flat = np.atleast_2d(np.asarray(points, dtype=float))
        return apply(invert(self.scene_to_plane), np.column_stack([flat, np.full(len(flat), z)]))

    def reachable(self) -> BaseGeometry | None:
        """Return where an arm can place (an area of the plane), or None if that is not known."""
        if not self.shoulders:
            return None
        rings = [
            shapely.Point(s).buffer(self.reach_max).difference(shapely.Point(s).buffer(self.reach_min))
            for s in self.shoulders
        ]
        return shapely.union_all(rings)


def build_surface(scene: Scene, view: View, config: PlacingConfig, options: SurfaceOptions = SURFACE) -> Surface:
    """Describe the support of a scene; `polygon` is None where no table was seen.

    Args:
        scene: with the table, if one was seen.
        view: the camera; its image's width gives the scale where neither table nor depth was seen.
        config: whose left and right is meant, and the arms' reach.
        options: of surfaces.
    """
    sign = -1.0 if config.perspective == "speaker" else 1.0
    table = scene.table
    if table is not None and _is_outline(table.polygon):
        return _metric_surface(scene, table, config, sign, options)
    with_depth = [d.geometry for d in scene.detections if d.geometry is not None]
    if with_depth and scene.frame_id == config.base_frame:
        lowest = min(float(g.pose[2, 3] - g.size[2] / 2.0) for g in with_depth)
        return _base_surface(None, lowest, config, sign)
    return _image_surface(scene, view, sign, options)


def _is_outline(corners: FloatArray) -> bool:
    return len(corners) >= POLYGON_CORNERS


def _base_surface(polygon: Polygon | None, height: float, config: PlacingConfig, sign: float) -> Surface:
    transform = np.eye(4)
    transform[2, 3] = -height
    y = ROBOT.shoulder_y_m
    return replace(
        _in_metres(polygon, transform, sign),
        shoulders=((0.0, y), (0.0, -y)),
        reach_min=config.reach_min_m,
        reach_max=config.reach_max_m,
    )


def _metric_surface(
    scene: Scene, table: TableSurface, config: PlacingConfig, sign: float, options: SurfaceOptions
) -> Surface:
    if scene.frame_id == config.base_frame:
        return _base_surface(_valid(Polygon(table.polygon[:, :2])), table.height_m, config, sign)
    up = table.normal / np.linalg.norm(table.normal)
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up  # the optical axis along the table
    if np.linalg.norm(ahead) < options.min_level_component:
        ahead = np.array([0.0, -1.0, 0.0]) - up[1] * -up  # looking straight down: up in the image is far
    ahead = ahead / np.linalg.norm(ahead)
    rotation = np.stack([ahead, np.cross(up, ahead), up])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ table.polygon.mean(axis=0)
    return _in_metres(_valid(Polygon(apply(transform, table.polygon)[:, :2])), transform, sign)


def _in_metres(polygon: Polygon | None, transform: FloatArray, sign: float) -> Surface:
    return Surface(
        polygon,
        metric=True,
        units_per_m=1.0,
        right=np.array([0.0, -1.0]) * sign,
        far=np.array([1.0, 0.0]) * sign,
        scene_to_plane=transform,
    )


def _image_surface(scene: Scene, view: View, sign: float, options: SurfaceOptions) -> Surface:
    outline = None
    if scene.table is not None and _is_outline(scene.table.image_polygon):
        outline = _valid(Polygon(scene.table.image_polygon))
    if outline is not None:
        width = outline.bounds[2] - outline.bounds[0]
    else:
        width = float(view.camera.width) if view.camera is not None else options.assumed_image_width_px
    return Surface(
        outline,
        metric=False,
        units_per_m=width / options.assumed_table_width_m,
        right=np.array([1.0, 0.0]) * sign,
        far=np.array([0.0, -1.0]) * sign,
        scene_to_plane=np.eye(4),
    )


def _valid(polygon: Polygon) -> Polygon:
    """Return a simple polygon: an outline that crosses itself becomes its largest part."""
    if polygon.is_valid:
        return polygon
    parts = [part for part in shapely.get_parts(shapely.make_valid(polygon)) if isinstance(part, Polygon)]
    return max(parts, key=lambda part: float(part.area)) if parts else as_polygon(polygon.convex_hull)


def as_polygon(geometry: BaseGeometry) -> Polygon:
    """Return a geometry that is a polygon as one; every other one becomes the empty polygon."""
    return geometry if isinstance(geometry, Polygon) else Polygon()


def compute_footprint(detection: Detection, surface: Surface, options: SurfaceOptions = SURFACE) -> Polygon:
    """Return the convex outline of an object on the plane: of its points, or of its mask without depth.

    Empty where the plane is metric and the object was seen without depth: where it stands is not known.
    """
    geometry = detection.geometry
    if surface.metric and geometry is not None:
        if len(geometry.cloud) >= options.min_cloud_points:
            points = surface.to_plane(geometry.cloud)[:, :2]
        else:
            half = geometry.size / 2.0
            corners = np.array([[x, y, 0.0] for x in (-half[0], half[0]) for y in (-half[1], half[1])])
            points = surface.to_plane(apply(geometry.pose, corners))[:, :2]
        return _with_area(MultiPoint(points).convex_hull, options.thin_outline_m)
    if surface.metric:
        return Polygon()
    rows, columns = np.nonzero(detection.mask)
    if len(rows) < options.min_cloud_points:
        b = detection.box
        return box(b.x_min, b.y_min, b.x_max, b.y_max)
    step = max(1, len(rows) // options.max_mask_points)
    return _with_area(MultiPoint(np.column_stack([columns, rows])[::step]).convex_hull, options.thin_outline_px)


def measure_extent(detection: Detection, options: SurfaceOptions = SURFACE) -> tuple[float, float, float]:
    """Return length, height and volume of an object: metres with depth, pixels without; never zero."""
    geometry, seen = detection.geometry, detection.box
    if geometry is not None:
        size = np.maximum(geometry.size, options.min_extent_m)
        return float(size.max()), float(size[2]), float(np.prod(size))
    width, height = max(seen.x_max - seen.x_min, 1.0), max(seen.y_max - seen.y_min, 1.0)
    return max(width, height), height, max(float(detection.mask.sum()), 1.0) ** 1.5


def _with_area(hull: BaseGeometry, growth: float) -> Polygon:
    """Return a hull as a polygon; one without area (a point, a line) grows by plane units."""
    return hull if isinstance(hull, Polygon) and hull.area > 0.0 else as_polygon(hull.buffer(growth))


def find_centre(polygon: BaseGeometry) -> FloatArray:
    """Return the centroid (2,) of an outline."""
    return np.array([polygon.centroid.x, polygon.centroid.y])
