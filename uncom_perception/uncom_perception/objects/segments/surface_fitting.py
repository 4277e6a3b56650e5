# SPDX-License-Identifier: Apache-2.0
"""Whether two surfaces can be parts of one object: a handle and what holds it, inside and outside of what is hollow."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.attributes.shape import body_sides
from uncom_perception.objects.segments.options import SURFACE_FIT, SurfaceFitOptions
from uncom_perception.types import LEAST_CORNERS


def may_be_hollow(
    one: npt.NDArray[np.float32], other: npt.NDArray[np.float32], *, options: SurfaceFitOptions = SURFACE_FIT
) -> bool:
    """Whether points (N, 3) and (M, 3) may be inside and outside of one object."""
    if stands(one, options=options) and stands(other, options=options):
        return False
    level = abs(quantile(one[:, 2], 98) - quantile(other[:, 2], 98)) < options.rim_m
    return (
        level or is_floor(one, other, alike=True, options=options) or is_floor(other, one, alike=True, options=options)
    )


def is_handle(
    mine: npt.NDArray[np.float32],
    theirs: npt.NDArray[np.float32],
    *,
    alike: bool = False,
    options: SurfaceFitOptions = SURFACE_FIT,
) -> bool:
    """Whether points (N, 3) are a long thin part in the air, which the object beside it must hold.

    Of that object as much must be seen, or a part if their colours are alike.
    """
    least = options.holds_alike if alike else options.holds
    if quantile(mine[:, 2], 5) < options.lowest_handle_m or len(theirs) < least * len(mine):
        return False
    width, length = sorted(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    hull = cv2.convexHull(np.ascontiguousarray(theirs[:, :2]))
    middle = mine[:, :2].mean(axis=0)
    if width > options.widest_handle_m or length < 2.0 * width or quantile(mine[:, 2], 95) > options.highest_handle_m:
        return False
    gap = -cv2.pointPolygonTest(hull, (float(middle[0]), float(middle[1])), True)
    return bool(0.0 < gap < 0.5 * length + 0.03)


def is_neck(
    mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, options: SurfaceFitOptions = SURFACE_FIT
) -> bool:
    """Whether points (N, 3) are the narrow top of a tall object of their colour, which others (M, 3) are the body of.

    The body of a bottle ends in no top of its own, as a can does that something stands on.
    """
    low, high = quantile(mine[:, 2], 5), quantile(mine[:, 2], 98)
    body = quantile(theirs[:, 2], 98)
    if (
        body < options.bottle_height_m
        or low < body - options.bottle_shoulder_m
        or high - low > options.bottle_neck_share * body
    ):
        return False
    length = max(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    if length > options.bottle_neck_m or has_top(theirs, options=options):
        return False
    return _share_within(mine, theirs) > options.within_alike


def is_floor(
    mine: npt.NDArray[np.float32],
    theirs: npt.NDArray[np.float32],
    *,
    alike: bool = False,
    options: SurfaceFitOptions = SURFACE_FIT,
) -> bool:
    """Whether points (N, 3) lie, seen from above, within the rim of others (M, 3): the inside of a hollow object.

    If their colours are alike, part of the rim may be hidden: the floor of a pan, which its wall rises beside.
    """
    if quantile(mine[:, 2], 95) >= quantile(theirs[:, 2], 95):
        return False
    if _share_within(mine, theirs) >= (options.within_alike if alike else options.within):
        return True
    low = quantile(mine[:, 2], 95) < options.floor_m and quantile(theirs[:, 2], 5) < 1.5 * options.floor_m
    shallow = quantile(theirs[:, 2], 95) < options.highest_handle_m
    return alike and low and shallow and _share_within(theirs, mine) < options.beside_share


def _share_within(points: npt.NDArray[np.float32], others: npt.NDArray[np.float32]) -> float:
    """Return the share of points (N, 3) within the convex outline of others (M, 3), seen from above."""
    hull = cv2.convexHull(np.ascontiguousarray(others[:, :2]))[:, 0].astype(float)
    if len(hull) < LEAST_CORNERS:
        return 0.0
    some = points[:: max(1, len(points) // 200), :2]
    return float(shapely.contains_xy(Polygon(hull), some[:, 0], some[:, 1]).mean())


def outline(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the corners (M, 2) of the convex outline of points (N, 3) seen from above [m]."""
    return np.asarray(cv2.convexHull(np.ascontiguousarray(points[:, :2]))[:, 0], dtype=np.float32)


def one_body(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two outlines seen from above are parts of one compact object."""
    sides = [cv2.minAreaRect(hull)[1] for hull in (a, b, np.concatenate([a, b]))]
    longest = max(*sides[0], *sides[1])
    return bool(max(sides[2]) < 1.15 * longest + 0.006 and min(sides[2]) > 0.5 * min(longest, 0.25))


def held_by(
    mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, options: SurfaceFitOptions = SURFACE_FIT
) -> bool:
    """Whether points (N, 3) are a handle and a part of the body that it is on, of which the others (M, 3) are, too."""
    (long_side, short_side), handle = body_sides(np.concatenate([mine, theirs]))
    sides = cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(theirs[:, :2])))[1]
    return bool(
        handle > options.least_handle_m
        and long_side < 1.15 * max(sides) + 0.006
        and short_side > 0.5 * max(sides)
        and max(quantile(mine[:, 2], 95), quantile(theirs[:, 2], 95)) < options.highest_handle_m
    )


def has_top(points: npt.NDArray[np.float32], *, options: SurfaceFitOptions = SURFACE_FIT) -> bool:
    """Whether points (N, 3) end in a surface seen from above, as solid objects do, and not in a rim."""
    high = points[points[:, 2] > quantile(points[:, 2], 98) - options.top_m]
    hull = cv2.convexHull(np.ascontiguousarray(high[:, :2]))
    if len(high) < options.least_top_points or min(cv2.minAreaRect(hull)[1]) < options.top_width_m:
        return False
    column, row = (np.floor(high[:, axis] / np.float32(options.cell_m)).astype(np.int64) for axis in (0, 1))
    cells = len(np.unique(column * 100_000 + row))
    return bool(cells * options.cell_m**2 > 0.6 * float(cv2.contourArea(hull)))


def stands(points: npt.NDArray[np.float32], *, options: SurfaceFitOptions = SURFACE_FIT) -> bool:
    """Whether points (N, 3) are a solid body with a top of its own."""
    return (
        len(points) >= options.fragment_pixels
        and quantile(points[:, 2], 98) > options.body_m
        and has_top(points, options=options)
    )
