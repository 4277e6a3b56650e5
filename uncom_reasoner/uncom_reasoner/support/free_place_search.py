# SPDX-License-Identifier: Apache-2.0
"""Where a thing can be set down: free cells that hold its footprint, reachable, and as the command wants it.

The centre of the moved thing may go wherever its whole outline stays on the support (less a margin) and clear of
every other outline (grown by the clearance): a Minkowski difference and sum. Among the free cells that contain such
points and satisfy the goal, the one whose best point costs least is chosen, and the thing goes to that point.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.exceptions import NoPlaceError
from uncom_reasoner.support.support_plane import Surface, centre_of
from uncom_reasoner.support.voronoi_cells import occupancy_map
from uncom_reasoner.types import Candidate, Cell, Choice, Factor, FloatArray, Rule

# Costs of centres (N, 2) with the moved outline (M, 2); infinite where the wish is not met.
Cost = Callable[[FloatArray, FloatArray], FloatArray]
MOST_CANDIDATES = 40
ROUND_SIDES = 16
EASY_REACH = 0.85  # share of the reach up to which places cost nothing


@dataclass(frozen=True)
class Place:
    """A chosen place: centre (2,) for the moved footprint, its cell, the map, and the cells weighed."""

    centre: FloatArray
    cell: Cell
    cells: tuple[Cell, ...]
    choice: Choice


def find_place(
    surface: Surface, moved: Polygon, obstacles: Mapping[str, Polygon], cost: Cost, config: PlacingConfig
) -> Place:
    """Choose a free place for an outline.

    First for the circle around the outline (any turn of the thing fits), then for the outline as it lies.

    Raises:
        NoPlaceError: no table, or nowhere free, reachable and as wanted; the text says which.
    """
    if surface.polygon is None or surface.polygon.is_empty:
        raise NoPlaceError("I cannot see a table to put it on.")
    unit = surface.unit
    cells = occupancy_map(surface.polygon, obstacles, config.cell_m * unit, config.clearance_m * unit)
    outline = np.asarray(moved.exterior.coords)[:-1] - centre_of(moved)
    radius = float(np.linalg.norm(outline, axis=1).max())
    turns = np.linspace(0.0, 2.0 * np.pi, ROUND_SIDES, endpoint=False)
    circle = radius / np.cos(np.pi / ROUND_SIDES) * np.column_stack([np.cos(turns), np.sin(turns)])
    why = "There is no free place big enough for it there."
    for shape in (circle, outline):
        try:
            return _choose(surface, shape, obstacles, cost, cells, config)
        except NoPlaceError as error:
            why = str(error)
    raise NoPlaceError(why)


def _choose(
    surface: Surface,
    shape: FloatArray,
    obstacles: Mapping[str, Polygon],
    cost: Cost,
    cells: tuple[Cell, ...],
    config: PlacingConfig,
) -> Place:
    free = free_centres(surface, shape, obstacles, config)
    if free.is_empty:
        raise NoPlaceError("There is no free place on the table that is big enough for it.")
    reachable = surface.reachable()
    if reachable is not None:
        free = free.intersection(reachable)
        if free.is_empty:
            raise NoPlaceError("I cannot reach any free place that is big enough for it.")
    wished = _with_reach(cost, surface)
    best: list[tuple[float, FloatArray, Cell]] = []
    empty = [cell for cell in cells if not cell.occupied_by]
    parts = shapely.intersection(np.array([Polygon(cell.polygon) for cell in empty]), free)
    for cell, part in zip(empty, parts, strict=True):
        points = _points_of(part)
        if len(points):
            costs = wished(points, shape)
            i = int(np.argmin(costs))
            if np.isfinite(costs[i]):
                best.append((float(costs[i]), points[i], cell))
    if not best:
        raise NoPlaceError("There is no free place there that is big enough for it and within my reach.")
    best.sort(key=lambda entry: entry[0])
    lowest, point, cell = best[0]
    lowest, point = _refine(point, lowest, shape, wished, Polygon(cell.polygon).intersection(free))
    best[0] = lowest, point, cell
    return Place(point, cell, cells, _weighed(best[:MOST_CANDIDATES]))


def _with_reach(cost: Cost, surface: Surface) -> Cost:
    """Return the cost with what it takes to reach far: near the limit an arm is stretched and may not find a way."""
    if not surface.reach:
        return cost
    shoulders, easy = np.array(surface.reach), EASY_REACH * surface.reach_max

    def with_reach(points: FloatArray, moved: FloatArray) -> FloatArray:
        reach = np.linalg.norm(points[:, None, :] - shoulders, axis=2).min(axis=1)
        return np.asarray(cost(points, moved) + (np.maximum(reach - easy, 0.0) / (0.05 * surface.unit)) ** 2)

    return with_reach


def free_centres(
    surface: Surface, shape: FloatArray, obstacles: Mapping[str, Polygon], config: PlacingConfig
) -> BaseGeometry:
    """Return where the centre of a convex outline (M, 2) can be: wholly on the support and clear of everything."""
    assert surface.polygon is not None  # noqa: S101 (callers looked)
    unit = surface.unit
    table = surface.polygon.buffer(-config.edge_margin_m * unit, join_style="mitre")
    free: BaseGeometry = table
    for vertex in shape:
        free = free.intersection(shapely.transform(table, partial(_shifted_back, by=vertex)))
    blocked: list[BaseGeometry] = []
    for ring in [table.exterior] if table.geom_type == "Polygon" else [p.exterior for p in shapely.get_parts(table)]:
        corners = np.asarray(ring.coords)
        if not table.convex_hull.equals_exact(table, 1e-6):  # an outline with dents: no edge may cross the footprint
            blocked += [_grown(corners[i : i + 2], shape) for i in range(len(corners) - 1)]
    for obstacle in obstacles.values():
        if not obstacle.is_empty:
            hull = cast("Polygon", obstacle.buffer(config.clearance_m * unit).convex_hull)
            blocked.append(_grown(np.asarray(hull.exterior.coords), shape))
    return free.difference(shapely.union_all(blocked)) if blocked else free


def _shifted_back(points: FloatArray, by: FloatArray) -> FloatArray:
    """Return points (N, 2) less a vector (2,)."""
    return np.asarray(points - by)


def _grown(points: FloatArray, shape: FloatArray) -> BaseGeometry:
    """Return the Minkowski sum of a convex set's corners and the mirrored outline."""
    return MultiPoint((points[:, None, :] - shape[None, :, :]).reshape(-1, 2)).convex_hull


def _points_of(area: BaseGeometry) -> FloatArray:
    """Return points of an area to weigh: its corners, its middle and points between (N, 2)."""
    found = []
    for part in shapely.get_parts(area):
        if part.geom_type != "Polygon" or part.area <= 0.0:
            continue
        middle = part.representative_point() if not part.contains(part.centroid) else part.centroid
        centre = np.array([middle.x, middle.y])
        corners = np.asarray(part.exterior.coords)[:-1]
        found += [centre[None, :], centre + 0.5 * (corners - centre), centre + 0.95 * (corners - centre)]
    if not found:
        return np.zeros((0, 2))
    points = np.vstack(found)
    return np.asarray(points[shapely.intersects_xy(area, points[:, 0], points[:, 1])])


def _refine(
    point: FloatArray, lowest: float, shape: FloatArray, cost: Cost, area: BaseGeometry
) -> tuple[float, FloatArray]:
    """Look for a cheaper point in the chosen cell on a fine grid; returns its cost and the point."""
    x_min, y_min, x_max, y_max = area.bounds
    x, y = np.meshgrid(np.linspace(x_min, x_max, 13), np.linspace(y_min, y_max, 13))
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[shapely.contains_xy(area, grid[:, 0], grid[:, 1])]
    if len(grid):
        costs = cost(grid, shape)
        i = int(np.argmin(costs))
        if costs[i] < lowest:
            return float(costs[i]), np.asarray(grid[i])
    return lowest, point


def _weighed(best: list[tuple[float, FloatArray, Cell]]) -> Choice:
    logs = np.array([-0.5 * c for c, _, _ in best])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    candidates = tuple(
        Candidate(cell.id, "free place", (Factor("place", float(log)),), float(q), chosen=i == 0)
        for i, ((_, _, cell), log, q) in enumerate(zip(best, logs, p, strict=True))
    )
    return Choice(candidates, candidates[0].id, float(p[0]), Rule.PLACE)
