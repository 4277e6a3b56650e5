# SPDX-License-Identifier: Apache-2.0
"""The occupancy map: Voronoi cells of the support, of useful size, clipped to it (paper, section III-H).

Seeds are spread evenly over the true outline (Lloyd's algorithm from a jittered grid, always the same), with more of
them around things. A cell is occupied where it meets a footprint grown by the clearance.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import cast

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Voronoi
from shapely.geometry import Polygon

from uncom_reasoner.types import Cell, FloatArray

MOST_SEEDS = 900
RELAXATIONS = 4


def occupancy_map(
    outline: Polygon, footprints: Mapping[str, Polygon], cell_size: float, clearance: float
) -> tuple[Cell, ...]:
    """Partition the outline into cells and say what occupies each.

    Args:
        outline: the support, any simple shape.
        footprints: what stands on it, by id.
        cell_size: wanted distance of seeds, in the outline's unit; cells near things have about half of it.
        clearance: how much each footprint grows.
    """
    shapes = tuple((name, shapely.to_wkb(shape)) for name, shape in footprints.items() if not shape.is_empty)
    return _partition(shapely.to_wkb(outline), shapes, float(cell_size), float(clearance))


@functools.lru_cache(maxsize=8)  # the readings of one command, and the answers to a question, share a map
def _partition(
    outline_wkb: bytes, shapes: tuple[tuple[str, bytes], ...], cell_size: float, clearance: float
) -> tuple[Cell, ...]:
    outline = cast("Polygon", shapely.from_wkb(outline_wkb))
    grown = {name: shapely.from_wkb(shape).buffer(clearance) for name, shape in shapes}
    seeds = _seeds(outline, list(grown.values()), cell_size)
    parts = _clipped(seeds, outline)
    touches = {name: shapely.intersects(np.array(parts), shape) for name, shape in grown.items()}
    return tuple(
        Cell(
            id=f"cell_{i}",
            polygon=np.asarray(part.exterior.coords)[:-1],
            centre=np.array([part.centroid.x, part.centroid.y]),
            occupied_by=" ".join(name for name in grown if touches[name][i]),
        )
        for i, part in enumerate(parts)
    )


def _seeds(outline: Polygon, things: list[Polygon], size: float) -> FloatArray:
    size = max(size, float(np.sqrt(outline.area / MOST_SEEDS)))
    points = _grid(outline, size, seed=1)
    fixed = [_ring(shape, size) for shape in things]
    rings = np.vstack([r for r in fixed if len(r)]) if any(len(r) for r in fixed) else np.zeros((0, 2))
    if len(rings):
        rings = rings[shapely.contains_xy(outline, rings[:, 0], rings[:, 1])]
    if len(rings):
        far = np.linalg.norm(points[:, None, :] - rings[None, :, :], axis=2).min(axis=1) > 0.5 * size
        points = points[far]
    for _ in range(RELAXATIONS):
        everything = np.vstack([points, rings]) if len(rings) else points
        regions = _regions(everything, outline)[: len(points)]
        centres = shapely.get_coordinates(shapely.centroid(regions))  # each holds its seed: none is empty
        inside = shapely.contains_xy(outline, centres[:, 0], centres[:, 1])  # a bent cell's may lie off the table
        points = np.where(inside[:, None], centres, points)
    return np.vstack([points, rings]) if len(rings) else points


def _grid(outline: Polygon, size: float, seed: int) -> FloatArray:
    x_min, y_min, x_max, y_max = outline.bounds
    x = np.arange(x_min + size / 2.0, x_max, size)
    y = np.arange(y_min + size / 2.0, y_max, size)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid + np.random.default_rng(seed).uniform(-0.2, 0.2, grid.shape) * size
    inside = grid[shapely.contains_xy(outline, grid[:, 0], grid[:, 1])] if len(grid) else grid
    if len(inside):
        return np.asarray(inside)
    point = outline.representative_point()
    return np.array([[point.x, point.y]])


def _ring(shape: Polygon, size: float) -> FloatArray:
    """Return seeds around a thing, a third of a cell away, closer together than elsewhere."""
    ring = shape.buffer(size / 3.0).exterior
    count = max(6, int(ring.length / (0.6 * size)))
    points = [ring.interpolate(i / count, normalized=True) for i in range(count)]
    return np.array([[p.x, p.y] for p in points])


def _regions(seeds: FloatArray, outline: Polygon) -> npt.NDArray[np.object_]:
    """Return each seed's part of the outline; distant helper seeds keep every region bounded."""
    x_min, y_min, x_max, y_max = outline.bounds
    span = 10.0 * max(x_max - x_min, y_max - y_min, 1e-6)
    cx, cy = (x_min + x_max) / 2.0, (y_min + y_max) / 2.0
    helpers = np.array([[cx - span, cy], [cx + span, cy], [cx, cy - span], [cx, cy + span]])
    diagram = Voronoi(np.vstack([seeds, helpers]))
    regions = [diagram.regions[diagram.point_region[i]] for i in range(len(seeds))]
    corners = diagram.vertices[np.concatenate(regions)]
    owners = np.repeat(np.arange(len(regions)), [len(region) for region in regions])
    hulls: npt.NDArray[np.object_] = np.asarray(shapely.convex_hull(shapely.multipoints(corners, indices=owners)))
    shapely.prepare(outline)
    inside = shapely.contains_properly(outline, hulls)
    hulls[~inside] = shapely.intersection(hulls[~inside], outline)
    return hulls


def _clipped(seeds: FloatArray, outline: Polygon) -> list[Polygon]:
    parts = shapely.get_parts(_regions(seeds, outline))
    return [p for p in parts if p.geom_type == "Polygon" and p.area > 1e-9 * outline.area]
