# SPDX-License-Identifier: Apache-2.0
"""Outline of the table top, also where objects cover it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon
from shapely.geometry import box as shapely_box
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import apply, invert

from uncom_perception.objects.table.options import TABLE_OUTLINE, TableOutlineOptions
from uncom_perception.objects.table.table_plane import Plane
from uncom_perception.types import Mask, TableSurface

FloatArray = npt.NDArray[np.float64]
PointImage = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Ground:
    """The table plane with a frame on it: x and y along the table, z up, from the frame that points are given in."""

    plane: Plane
    to_ground: FloatArray

    def project(self, depth: npt.NDArray[np.float32], camera: PinholeCamera, pose: FloatArray) -> PointImage:
        """Return a depth image (H, W) [m] as points (H, W, 3): x, y on the table and height above the plane [m].

        pose (4, 4) is the camera's in the frame that the ground lies in.
        """
        to_ground = self.to_ground @ pose
        to_ground[2, :3] = self.plane.normal @ pose[:3, :3]
        to_ground[2, 3] = self.plane.normal @ pose[:3, 3] - self.plane.offset
        u = (np.arange(depth.shape[1]) - camera.cx) / camera.fx
        v = (np.arange(depth.shape[0]) - camera.cy) / camera.fy
        planes = []
        for along, down, ahead, shift in to_ground[:3]:
            rays = (down * v + ahead).astype(np.float32)[:, None] + (along * u).astype(np.float32)
            rays *= depth
            rays += np.float32(shift)
            planes.append(rays)
        return np.asarray(cv2.merge(planes), dtype=np.float32)


def ground_frame(plane: Plane, *, gravity_known: bool) -> Ground:
    """Put a frame on the plane: in a base frame the axes are that frame's, else x goes along the image."""
    pose = np.eye(4)
    if gravity_known:
        pose[:3, 3] = (0.0, 0.0, plane.offset / plane.normal[2])
        return Ground(plane, invert(pose))
    x = np.array([1.0, 0.0, 0.0]) - plane.normal[0] * plane.normal
    x /= np.linalg.norm(x)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = x, np.cross(plane.normal, x), plane.normal
    pose[:3, 3] = plane.offset * plane.normal
    return Ground(plane, invert(pose))


def table_pixels(height: npt.NDArray[np.float32], sigma_m: float) -> Mask:
    """Return the pixels (H, W) that lie on the plane, without thin stripes where walls cross it."""
    level = max(0.006, 4.0 * sigma_m)
    mask = cv2.inRange(height, -level, level)
    # Half the pixels a row and half the rows tell the large pieces.
    half = cv2.morphologyEx(np.ascontiguousarray(mask[::2, ::2]), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(half, connectivity=4)
    if count <= 1:
        return np.zeros(height.shape, dtype=bool)
    areas = stats[1:, cv2.CC_STAT_AREA]
    keep = np.concatenate([[0], areas > max(40, 0.01 * areas.max())]).astype(np.uint8)[labels]
    whole = cv2.resize(keep, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)[: height.shape[0], : height.shape[1]]
    return np.asarray((mask & whole).view(bool))


def find_table(
    ground_points: PointImage,
    on_table: Mask,
    ground: Ground,
    camera: PinholeCamera,
    frame_to_camera: FloatArray,
    *,
    options: TableOutlineOptions = TABLE_OUTLINE,
) -> tuple[TableSurface, FloatArray]:
    """Return the table's surface, and its outline (N, 2) on the ground [m].

    A rectangle about what is seen is taken for the table where nothing seen speaks against it, so that objects and the
    image's border do not bite corners off; else the convex outline of what is seen.
    """
    contours = cv2.findContours(on_table.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    border = np.concatenate(contours)[:, 0]
    hull = cv2.convexHull(np.ascontiguousarray(ground_points[border[:, 1], border[:, 0], :2]))[:, 0]
    rectangle = cv2.boxPoints(cv2.minAreaRect(hull))
    outline = np.asarray(hull, dtype=float)
    if not _contradicted(rectangle, hull, ground_points, ground, camera, frame_to_camera, options=options):
        outline = np.asarray(rectangle, dtype=float)
    else:
        outline = np.asarray(cv2.approxPolyDP(outline.astype(np.float32)[:, None], 0.004, True)[:, 0], dtype=float)
    if Polygon(outline).exterior.is_ccw is False:
        outline = outline[::-1]
    polygon = apply(invert(ground.to_ground), np.column_stack([outline, np.zeros(len(outline))]))
    image = _image_polygon(apply(frame_to_camera, polygon), camera)
    return TableSurface(polygon, ground.plane.normal, image), outline


def _contradicted(
    rectangle: npt.NDArray[np.float32],
    hull: npt.NDArray[np.float32],
    ground_points: PointImage,
    ground: Ground,
    camera: PinholeCamera,
    frame_to_camera: FloatArray,
    *,
    options: TableOutlineOptions = TABLE_OUTLINE,
) -> bool:
    """Whether the camera sees through the rectangle beside the hull: there is no table there."""
    origin, a, b = rectangle[0], rectangle[1] - rectangle[0], rectangle[3] - rectangle[0]
    s = (np.arange(36) + 0.5) / 36.0
    grid = origin + s[:, None, None] * a + s[None, :, None] * b
    flat = grid.reshape(-1, 2)
    outside = ~shapely.contains_xy(Polygon(hull).buffer(0.01), flat[:, 0], flat[:, 1])
    if outside.mean() > options.outside_share:
        return True
    frame = apply(invert(ground.to_ground), np.column_stack([flat[outside], np.zeros(outside.sum())]))
    pixels = np.round(np.nan_to_num(camera.project(apply(frame_to_camera, frame)), nan=-1.0)).astype(int)
    u, v = pixels[:, 0], pixels[:, 1]
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    height = ground_points[v[inside], u[inside], 2]
    return float((height < options.below_m).sum()) / len(flat) > options.seen_through_share


def _image_polygon(corners_camera: FloatArray, camera: PinholeCamera) -> FloatArray:
    """Project an outline (N, 3) of the optical frame and cut it at the image's border."""
    steps = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None]
    edges = [a + steps * (b - a) for a, b in zip(corners_camera, np.roll(corners_camera, -1, axis=0), strict=True)]
    dense = np.concatenate(edges)
    pixels = camera.project(dense[dense[:, 2] > TABLE_OUTLINE.least_distance_m])
    shape = Polygon(pixels).buffer(0) & shapely_box(0, 0, camera.width - 1, camera.height - 1)
    outer = shape.simplify(0.5)
    if not isinstance(outer, Polygon) or outer.is_empty:
        return np.zeros((0, 2))
    return np.asarray(outer.exterior.coords[:-1], dtype=np.float64)


class TopDown:
    """A raster over the table seen from above, for fast questions about places (cells of 5 mm)."""

    def __init__(self, outline: FloatArray, reach_m: float, *, options: TableOutlineOptions = TABLE_OUTLINE) -> None:
        """Cover an outline (N, 2) and what is at most reach_m around it."""
        self._options = options
        self._origin = (outline.min(axis=0) - reach_m - 0.02).astype(np.float32)
        size = np.ceil((outline.max(axis=0) + reach_m + 0.02 - self._origin) / self._options.cell_m).astype(int)
        raster = np.ones((int(size[1]), int(size[0])), np.uint8)
        corners = np.round((outline - self._origin) / self._options.cell_m).astype(np.int32)
        cv2.fillPoly(raster, [corners.reshape(-1, 1, 2)], 0)
        self._distance = cv2.distanceTransform(raster, cv2.DIST_L2, 3) * np.float32(self._options.cell_m)
        self.reach_m = reach_m

    def distance(self, flat: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
        """Return how far known places (N, 2) [m] are from the outline, 0 within; infinite beyond the reach."""
        x, y = (
            ((flat[:, k] - self._origin[k]) * np.float32(1.0 / self._options.cell_m)).astype(np.int32) for k in (0, 1)
        )
        rows, columns = self._distance.shape
        valid = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
        found = np.full(len(flat), np.inf, np.float32)
        found[valid] = self._distance[y[valid], x[valid]]
        return found
