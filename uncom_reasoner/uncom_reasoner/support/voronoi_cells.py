# SPDX-License-Identifier: Apache-2.0
"""The occupancy map: Voronoi cells of the support, of useful size, clipped to it (paper, section III-H).

Seeds are spread evenly over the true outline (Lloyd's algorithm from a jittered grid, always the same), with more of
them around obstacles. A cell is occupied where it meets a footprint grown by the clearance.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Voronoi
from shapely.geometry import Polygon
from uncom_common.transforms import FloatArray

from uncom_reasoner.support.options import VORONOI, VoronoiOptions
from uncom_reasoner.support.support_plane import as_polygon
from uncom_reasoner.types import Cell


def build_occupancy_map(
    outline: Polygon,
    footprints: Mapping[str, Polygon],
    cell_size: float,
    clearance: float,
    options: VoronoiOptions = VORONOI,
) -> tuple[Cell, ...]:
    """Partition the outline into cells and say what occupies each.

    Args:
        outline: the support, any simple shape.
        footprints: what stands on it, by id.
        cell_size: wanted distance of seeds, in the outline's unit; cells near obstacles have about half of it.
        clearance: how much each footprint grows, in the same unit.
        options: of the seeds.
    """
    shapes = tuple((name, shapely.to_wkb(shape)) for name, shape in footprints.items() if not shape.is_empty)
    return _partition(shapely.to_wkb(outline), shapes, float(cell_size), float(clearance), options)


@functools.lru_cache(maxsize=8)  # the interpretations of one command, and the answers to a question, share a map
def _partition(
    outline_wkb: bytes,
    shapes: tuple[tuple[str, bytes], ...],
    cell_size: float,
    clearance: float,
    options: VoronoiOptions,
) -> tuple[Cell, ...]:
    outline = as_polygon(shapely.from_wkb(outline_wkb))
    grown = {name: as_polygon(shapely.from_wkb(shape).buffer(clearance)) for name, shape in shapes}
    seeds = _place_seeds(outline, list(grown.values()), cell_size, options)
    parts = _cut_cells(seeds, outline, options)
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


def _place_seeds(outline: Polygon, obstacles: list[Polygon], size: float, options: VoronoiOptions) -> FloatArray:
    """Return seeds (N, 2): an even spread over the outline, and rings around the obstacles that stay where they are."""
    size = max(size, float(np.sqrt(outline.area / options.max_seeds)))
    seeds = _spread_grid(outline, size, options.jitter, seed=1)
    rings = [ring for ring in (_ring_seeds(shape, size, options) for shape in obstacles) if len(ring)]
    fixed = np.vstack(rings) if rings else np.zeros((0, 2))
    if len(fixed):
        fixed = fixed[shapely.contains_xy(outline, fixed[:, 0], fixed[:, 1])]
    if len(fixed):
        distances = np.linalg.norm(seeds[:, None, :] - fixed[None, :, :], axis=2).min(axis=1)
        seeds = seeds[distances > options.clear_share * size]
    for _ in range(options.relaxations):
        everything = np.vstack([seeds, fixed]) if len(fixed) else seeds
        regions = _cut_regions(everything, outline, options)[: len(seeds)]
        centres = shapely.get_coordinates(shapely.centroid(regions))  # each holds its seed: none is empty
        inside = shapely.contains_xy(outline, centres[:, 0], centres[:, 1])  # a bent cell's may lie off the table
        seeds = np.where(inside[:, None], centres, seeds)
    return np.vstack([seeds, fixed]) if len(fixed) else seeds


def _spread_grid(outline: Polygon, size: float, jitter: float, seed: int) -> FloatArray:
    """Return a jittered grid of points (N, 2) in an outline; at least one."""
    x_min, y_min, x_max, y_max = outline.bounds
    x = np.arange(x_min + size / 2.0, x_max, size)
    y = np.arange(y_min + size / 2.0, y_max, size)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid + np.random.default_rng(seed).uniform(-jitter, jitter, grid.shape) * size
    inside = grid[shapely.contains_xy(outline, grid[:, 0], grid[:, 1])] if len(grid) else grid
    if len(inside):
        return np.asarray(inside)
    point = outline.representative_point()
    return np.array([[point.x, point.y]])


def _ring_seeds(shape: Polygon, size: float, options: VoronoiOptions) -> FloatArray:
    """Return seeds (N, 2) around an obstacle, closer together than elsewhere."""
    ring = as_polygon(shape.buffer(size / options.ring_divisor)).exterior
    count = max(options.ring_min_seeds, int(ring.length / (options.ring_spacing * size)))
    points = [ring.interpolate(i / count, normalized=True) for i in range(count)]
    return np.array([[p.x, p.y] for p in points])


def _cut_regions(seeds: FloatArray, outline: Polygon, options: VoronoiOptions) -> npt.NDArray[np.object_]:
    """Return each seed's part of the outline; distant helper seeds keep every region bounded."""
    x_min, y_min, x_max, y_max = outline.bounds
    span = options.span_factor * max(x_max - x_min, y_max - y_min, 1e-6)
    cx, cy = (x_min + x_max) / 2.0, (y_min + y_max) / 2.0
    helpers = np.array([[cx - span, cy], [cx + span, cy], [cx, cy - span], [cx, cy + span]])
    diagram = Voronoi(np.vstack([seeds, helpers]))
    regions = [diagram.regions[diagram.point_region[i]] for i in range(len(seeds))]
    corners = diagram.vertices[np.concatenate(regions)]
    owners = np.repeat(np.arange(len(regions)), [len(region) for region in regions])
    hulls = np.asarray(shapely.convex_hull(shapely.multipoints(corners, indices=owners)))
    shapely.prepare(outline)
    inside = shapely.contains_properly(outline, hulls)
    hulls[~inside] = shapely.intersection(hulls[~inside], outline)
    return hulls


def _cut_cells(seeds: FloatArray, outline: Polygon, options: VoronoiOptions) -> list[Polygon]:
    parts = shapely.get_parts(_cut_regions(seeds, outline, options))
    return [p for p in parts if isinstance(p, Polygon) and p.area > 1e-9 * outline.area]
