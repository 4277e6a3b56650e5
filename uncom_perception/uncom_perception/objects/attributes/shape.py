# SPDX-License-Identifier: Apache-2.0
"""Shape of an object as numbers that words can be defined by, from its visible points."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantile, quantiles
from uncom_perception.objects.attributes.options import SHAPE, ShapeOptions

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Shape:
    """Measures of an object that stands on the ground; lengths in metres, ratios without unit."""

    length: float  # longer side of the footprint's box [m]
    width: float  # shorter side of it, a handle left out [m]
    height: float  # above the ground [m]
    elongation: float  # length / width of the footprint, handle included
    flatness: float  # height / length
    roundness: float  # 1: the body's footprint is a disc
    rectangularity: float  # 1: the footprint fills its box
    hollowness: float  # share of the footprint's middle that is lower than its rim
    cavity: float  # depth of that cavity / height
    handle: float  # length of what sticks out of a round body [m]
    curvature: float  # bow of a long object: sagitta / length
    flat_top: float  # share of the footprint at the top's height
    neck: float  # width near the top / width of the lower half
    taper: float  # width at two thirds of the height / width at one third

    def items(self) -> dict[str, float]:
        """Return the measures by name."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self)}


@dataclass(frozen=True, slots=True)
class Footprint:
    """An object seen from above: greatest height by cell (NaN: none), origin of the cell grid [m]."""

    height: npt.NDArray[np.float32]
    origin: FloatArray

    @property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Cells that hold something."""
        return np.isfinite(self.height)


def measure(
    points: npt.NDArray[np.floating],
    viewer: FloatArray,
    hull: npt.NDArray[np.float32] | None = None,
    *,
    options: ShapeOptions = SHAPE,
) -> Shape:
    """Measure an object by points (N, 3) as x, y, height [m], seen from a viewer (3,) in the same frame.

    The hull (M, 1, 2) is their convex outline seen from above, if it is known.
    """
    footprint = _rasterise(points, options=options)
    mask = cv2.morphologyEx(footprint.mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    outline = hull if hull is not None else cv2.convexHull(np.ascontiguousarray(points[:, :2], dtype=np.float32))
    (_, _), (side_a, side_b), _ = cv2.minAreaRect(outline)
    long_side, short_side = float(max(side_a, side_b)), float(min(side_a, side_b))
    height = quantile(points[:, 2], 98.5)
    body, handle = _split_handle(mask, options=options)
    body_hull = cv2.convexHull(_largest_contour(body))
    (_, _), (body_a, body_b), _ = cv2.minAreaRect(body_hull)
    body_width, body_length = min(body_a, body_b) * options.cell_m, max(body_a, body_b) * options.cell_m
    radius = cv2.minEnclosingCircle(body_hull)[1] + 0.5
    hull_area = max(float(cv2.contourArea(body_hull)), 1.0)
    hollow, cavity = _cavity(footprint, body, height, options=options)
    high = int(np.count_nonzero(footprint.height > height - max(0.006, 0.08 * height)))
    top = high / max(int(np.count_nonzero(footprint.mask)), 1)
    some = points[:: 1 + len(points) // options.max_points]
    neck, taper = _profile(some, viewer, height)
    return Shape(
        length=long_side,
        width=min(short_side, body_width),
        height=height,
        elongation=long_side / max(short_side, 1e-3),
        flatness=height / max(long_side, 1e-3),
        roundness=float(
            np.clip(hull_area / (np.pi * radius**2) * min(1.0, body_width / max(body_length, 1e-3)) ** 0.5, 0.0, 1.0)
        ),
        rectangularity=float(np.clip(hull_area / max(body_a * body_b, 1.0), 0.0, 1.0)),
        hollowness=hollow,
        cavity=cavity,
        handle=handle,
        curvature=_curvature(some, options=options),
        flat_top=top,
        neck=neck,
        taper=taper,
    )


def body_sides(points: npt.NDArray[np.floating], *, options: ShapeOptions = SHAPE) -> tuple[tuple[float, float], float]:
    """Return the longer and the shorter side of a footprint without its handle, and the handle's length [m]."""
    mask = cv2.morphologyEx(
        _rasterise(points, options=options).mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)
    )
    body, handle = _split_handle(mask, options=options)
    sides = cv2.minAreaRect(cv2.convexHull(_largest_contour(body)))[1]
    return (max(sides) * options.cell_m, min(sides) * options.cell_m), handle


def _rasterise(points: npt.NDArray[np.floating], *, options: ShapeOptions = SHAPE) -> Footprint:
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    origin = np.array([float(x.min()), float(y.min())]) - 2 * options.cell_m
    column = ((x - origin[0]) * (1.0 / options.cell_m) + 0.5).astype(np.int32)
    row = ((y - origin[1]) * (1.0 / options.cell_m) + 0.5).astype(np.int32)
    width, length = int(column.max()) + 3, int(row.max()) + 3
    flat = np.full(width * length, -1.0, np.float32)
    np.maximum.at(flat, row * width + column, np.asarray(points[:, 2], np.float32))
    height = flat.reshape(length, width)
    kernel = np.ones((3, 3), np.uint8)
    closed = cv2.morphologyEx((height >= 0.0).astype(np.uint8), cv2.MORPH_CLOSE, kernel).view(bool)
    gaps = closed & (height < 0.0)
    height[gaps] = cv2.dilate(height, kernel)[gaps]
    height[height < 0.0] = np.nan
    return Footprint(height, origin)


def _grown(mask: npt.NDArray[np.uint8], radius: float) -> npt.NDArray[np.uint8]:
    """Dilate by a disc; the distance transform does in one pass what large kernels take long for."""
    return np.asarray(cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3) <= radius, dtype=np.uint8)


def _shrunk(mask: npt.NDArray[np.uint8], radius: float) -> npt.NDArray[np.uint8]:
    """Erode by a disc; beyond the border there is nothing."""
    return np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 3) > radius, dtype=np.uint8)


def _largest_contour(mask: npt.NDArray[np.uint8]) -> npt.NDArray[np.int32]:
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return np.array([[[0, 0]], [[1, 0]], [[1, 1]]], np.int32)
    return np.asarray(max(contours, key=len), dtype=np.int32)


def _split_handle(mask: npt.NDArray[np.uint8], *, options: ShapeOptions = SHAPE) -> tuple[npt.NDArray[np.uint8], float]:
    """Return the body without what sticks out of it, and the length of that [m]."""
    # The sides of a rim are often lost: close the ring before its inside counts as inside.
    gap = 0.5 * float(np.clip(0.45 * min(mask.shape), 5, 31))
    pad = int(gap) + 2
    ring = _shrunk(_grown(np.pad(mask, pad), gap), gap)[pad:-pad, pad:-pad]
    filled = np.zeros_like(mask)
    outlines = cv2.findContours(ring, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    cv2.drawContours(filled, outlines, -1, 1, cv2.FILLED)
    inner = cv2.distanceTransform(np.pad(filled, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
    size = max(1.0, 0.55 * float(inner.max()))
    body = _grown((inner > size).astype(np.uint8), size) & filled
    if not body.any():
        return filled, 0.0
    rest = cv2.morphologyEx(filled & (1 - body), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    if not rest.any():
        return body, 0.0
    count, labels, stats, _ = cv2.connectedComponentsWithStats(rest)
    if count <= 1:
        return body, 0.0
    distance = cv2.distanceTransform(1 - body, cv2.DIST_L2, 3)
    reach = [
        float(distance[labels == i].max())
        for i in range(1, count)
        if stats[i, cv2.CC_STAT_AREA] >= options.least_handle_cells
    ]
    return body, max(reach, default=0.0) * options.cell_m


def _cavity(
    footprint: Footprint, body: npt.NDArray[np.uint8], height: float, *, options: ShapeOptions = SHAPE
) -> tuple[float, float]:
    """Return the share of the middle of the footprint that is lower than its rim, and how deep it is / height.

    The rim is the outer ring of the body, sector by sector, so that gaps in it do not matter. A middle of which nothing
    is seen, inside a ring that is, lies behind the front rim: the top of a solid object would be seen from above.
    """
    rows, columns = np.nonzero(body)
    across, down = (values.astype(np.float32) for values in (columns, rows))
    radius, angle = cv2.cartToPolar(across - across.mean(), down - down.mean())
    radius = radius.ravel()
    sector = (angle.ravel() * np.float32(options.sectors / (2.0 * np.pi))).astype(np.int32) % options.sectors
    reach = np.zeros(options.sectors, np.float32)
    np.maximum.at(reach, sector, radius)
    reach = np.maximum(reach, 1.0)
    if reach.mean() * options.cell_m < options.least_cavity_radius_m:
        return 0.0, 0.0
    share = radius / reach[sector]
    heights = footprint.height[rows, columns]
    seen = np.isfinite(heights)
    rims = np.full(options.sectors, -np.inf, np.float32)
    outer = seen & (share > options.rim_from)
    np.maximum.at(rims, sector[outer], heights[outer])
    rims = rims[np.isfinite(rims)]
    middle = share < options.middle_to
    count = np.count_nonzero(middle)
    if len(rims) < options.sectors // 2 or count < options.least_middle_points:
        return 0.0, 0.0
    rim = quantile(rims, 60)
    unseen = np.count_nonzero(middle & ~seen)
    low = np.count_nonzero(middle & (heights < rim - max(0.003, 0.12 * height)))
    hollow = (low + unseen) / count
    inner = heights[seen & (share < options.inner_to)]
    depth = rim - quantile(inner, 5) if len(inner) else 0.0
    if unseen > 0.5 * count:
        depth = max(depth, 0.7 * height)  # so deep that the rim hides the floor
    return hollow, min(max(depth / max(height, 1e-3), 0.0), 1.0) if hollow > options.least_hollowness else 0.0


def _curvature(points: npt.NDArray[np.floating], *, options: ShapeOptions = SHAPE) -> float:
    """Return how far the middle of an object lies off the line between its ends, over its length."""
    x, y = (points[:, k] - points[:, k].mean() for k in (0, 1))
    angle = 0.5 * math.atan2(2.0 * float(x @ y), float(x @ x) - float(y @ y))  # of the longer axis
    cosine, sine = np.float32(math.cos(angle)), np.float32(math.sin(angle))
    along, across = cosine * x + sine * y, cosine * y - sine * x
    start, end = float(along.min()), float(along.max())
    length = end - start
    if length < options.least_length_m:
        return 0.0
    bins = ((along - start) * (0.9999 * options.slices / length)).astype(np.uint8)
    order = np.argsort(bins, kind="stable")
    parts = np.split(across[order], np.cumsum(np.bincount(bins, minlength=options.slices))[:-1])
    known = np.array([len(part) > 0 for part in parts])
    if known.sum() < options.least_slices:
        return 0.0
    middle = np.array([quantile(part, 50) for part in parts if len(part)])
    t = np.linspace(-1.0, 1.0, options.slices)[known]
    terms = np.stack([t * t, t, np.ones_like(t)])
    bend = np.linalg.solve(terms @ terms.T, terms @ middle)[0]
    return float(abs(bend) / length)


def _profile(points: npt.NDArray[np.floating], viewer: FloatArray, height: float) -> tuple[float, float]:
    """Compare widths across the line of sight (never hidden by the object itself) at several heights."""
    center = [float(points[:, k].mean()) for k in (0, 1)]
    ahead, aside = center[0] - float(viewer[0]), center[1] - float(viewer[1])
    norm = math.hypot(ahead, aside)
    ahead, aside = (ahead / norm, aside / norm) if norm > SHAPE.least_length_m else (1.0, 0.0)
    across = points[:, 1] * np.float32(ahead) - points[:, 0] * np.float32(aside)
    share = points[:, 2] * np.float32(1.0 / max(height, 1e-3))

    def width(low: float, high: float) -> float:
        band = across[(share >= low) & (share < high)]
        if len(band) < SHAPE.least_band_points:
            return float("nan")
        low_end, high_end = quantiles(band, (3, 97))
        return high_end - low_end

    top, upper, lower, low = width(0.88, 1.05), width(0.6, 0.75), width(0.25, 0.4), width(0.1, 0.6)
    neck = top / low if math.isfinite(top) and math.isfinite(low) and low > SHAPE.least_width_m else 1.0
    taper = upper / lower if math.isfinite(upper) and math.isfinite(lower) and lower > SHAPE.least_width_m else 1.0
    return min(max(neck, 0.0), 3.0), min(max(taper, 0.0), 3.0)
