# SPDX-License-Identifier: Apache-2.0
"""Where an object can be set down: free cells that hold its footprint, reachable, and as the command wants it.

The centre of the moved object may go wherever its whole outline stays on the support (less a margin) and clear of
every other outline (grown by the clearance): a Minkowski difference and sum. Among the free cells that contain such
points and satisfy the goal, the one whose best point costs least is chosen, and the object goes to that point.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon
from shapely.geometry.base import BaseGeometry
from uncom_common.transforms import FloatArray

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.exceptions import NoPlaceError
from uncom_reasoner.support.options import PLACE_SEARCH, PlaceSearchOptions
from uncom_reasoner.support.support_plane import Surface, as_polygon, find_centre
from uncom_reasoner.support.voronoi_cells import build_occupancy_map
from uncom_reasoner.types import Candidate, Cell, Choice, Factor, Rule

NO_TABLE = "I cannot see a table to put it on."
# Costs of centres (N, 2) with the moved outline (M, 2); infinite where the wish is not met.
Cost = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Place:
    """A chosen place: centre (2,) for the moved footprint, its cell, the map, and the cells weighed."""

    centre: FloatArray
    cell: Cell
    cells: tuple[Cell, ...]
    choice: Choice


def find_place(
    surface: Surface,
    moved: Polygon,
    obstacles: Mapping[str, Polygon],
    cost: Cost,
    config: PlacingConfig,
    options: PlaceSearchOptions = PLACE_SEARCH,
) -> Place:
    """Choose a free place for an outline.

    First for the circle around the outline (any turn of the object fits), then for the outline as it lies.

    Args:
        surface: the support.
        moved: outline of what is moved, in plane coordinates.
        obstacles: outlines of all else, by id.
        cost: what the place should be like.
        config: clearances and size of the cells.
        options: of the search.

    Raises:
        NoPlaceError: no table, or nowhere free, reachable and as wanted; the text says which.
    """
    if surface.polygon is None or surface.polygon.is_empty:
        raise NoPlaceError(NO_TABLE)
    unit = surface.units_per_m
    cells = build_occupancy_map(surface.polygon, obstacles, config.cell_m * unit, config.clearance_m * unit)
    outline = np.asarray(moved.exterior.coords)[:-1] - find_centre(moved)
    radius = float(np.linalg.norm(outline, axis=1).max())
    turns = np.linspace(0.0, 2.0 * np.pi, options.circle_sides, endpoint=False)
    circle = radius / np.cos(np.pi / options.circle_sides) * np.column_stack([np.cos(turns), np.sin(turns)])
    why = "There is no free place big enough for it there."
    for shape in (circle, outline):
        try:
            return _choose_place(surface, shape, obstacles, cost, cells, config, options)
        except NoPlaceError as error:
            why = str(error)
    raise NoPlaceError(why)


def _choose_place(
    surface: Surface,
    shape: FloatArray,
    obstacles: Mapping[str, Polygon],
    cost: Cost,
    cells: tuple[Cell, ...],
    config: PlacingConfig,
    options: PlaceSearchOptions,
) -> Place:
    free = find_free_centres(surface, shape, obstacles, config)
    if free.is_empty:
        raise NoPlaceError("There is no free place on the table that is big enough for it.")
    reachable = surface.reachable()
    if reachable is not None:
        free = free.intersection(reachable)
        if free.is_empty:
            raise NoPlaceError("I cannot reach any free place that is big enough for it.")
    total_cost = _add_reach_cost(cost, surface, options)
    best: list[tuple[float, FloatArray, Cell]] = []
    empty = [cell for cell in cells if not cell.occupied_by]
    parts = shapely.intersection(np.array([Polygon(cell.polygon) for cell in empty]), free)
    for cell, part in zip(empty, parts, strict=True):
        points = _sample_area(part, options)
        if len(points):
            costs = total_cost(points, shape)
            i = int(np.argmin(costs))
            if np.isfinite(costs[i]):
                best.append((float(costs[i]), points[i], cell))
    if not best:
        raise NoPlaceError("There is no free place there that is big enough for it and within my reach.")
    best.sort(key=lambda entry: entry[0])
    lowest, point, cell = best[0]
    area = Polygon(cell.polygon).intersection(free)
    lowest, point = _refine(point, lowest, shape, total_cost, area, options)
    best[0] = lowest, point, cell
    return Place(point, cell, cells, _weigh_cells(best[: options.max_candidates]))


def _add_reach_cost(cost: Cost, surface: Surface, options: PlaceSearchOptions) -> Cost:
    """Return the cost with what it takes to reach far: near the limit an arm is stretched and may not find a path."""
    if not surface.shoulders:
        return cost
    shoulders, easy = np.array(surface.shoulders), options.easy_reach_share * surface.reach_max
    sigma = options.far_reach_sigma_m * surface.units_per_m

    def with_reach(points: FloatArray, moved: FloatArray) -> FloatArray:
        reach = np.linalg.norm(points[:, None, :] - shoulders, axis=2).min(axis=1)
        return np.asarray(cost(points, moved) + (np.maximum(reach - easy, 0.0) / sigma) ** 2)

    return with_reach


def find_free_centres(
    surface: Surface, shape: FloatArray, obstacles: Mapping[str, Polygon], config: PlacingConfig
) -> BaseGeometry:
    """Return where the centre of a convex outline (M, 2) can be: wholly on the support and clear of everything.

    Raises:
        NoPlaceError: no table was seen.
    """
    if surface.polygon is None:
        raise NoPlaceError(NO_TABLE)
    unit = surface.units_per_m
    table = surface.polygon.buffer(-config.edge_margin_m * unit, join_style="mitre")
    free: BaseGeometry = table
    for vertex in shape:
        free = free.intersection(_translate(table, -vertex))
    blocked: list[BaseGeometry] = []
    for part in shapely.get_parts(table):
        corners = np.asarray(part.exterior.coords)
        if not table.convex_hull.equals_exact(table, 1e-6):  # an outline with dents: no edge may cross the footprint
            blocked += [_minkowski_sum(corners[i : i + 2], shape) for i in range(len(corners) - 1)]
    for obstacle in obstacles.values():
        if not obstacle.is_empty:
            hull = as_polygon(obstacle.buffer(config.clearance_m * unit).convex_hull)
            blocked.append(_minkowski_sum(np.asarray(hull.exterior.coords), shape))
    return free.difference(shapely.union_all(blocked)) if blocked else free


def _translate(geometry: BaseGeometry, offset: FloatArray) -> BaseGeometry:
    return shapely.transform(geometry, lambda points: points + offset)


def _minkowski_sum(points: FloatArray, shape: FloatArray) -> BaseGeometry:
    """Return the Minkowski sum of a convex set's corners and the mirrored outline."""
    return MultiPoint((points[:, None, :] - shape[None, :, :]).reshape(-1, 2)).convex_hull


def _sample_area(area: BaseGeometry, options: PlaceSearchOptions) -> FloatArray:
    """Return points (N, 2) of an area to weigh: its middle, points near its corners, and points between."""
    found = []
    for part in shapely.get_parts(area):
        if not isinstance(part, Polygon) or part.area <= 0.0:
            continue
        middle = part.representative_point() if not part.contains(part.centroid) else part.centroid
        centre = np.array([middle.x, middle.y])
        corners = np.asarray(part.exterior.coords)[:-1]
        found += [centre[None, :], *(centre + share * (corners - centre) for share in options.inner_shares)]
    if not found:
        return np.zeros((0, 2))
    points = np.vstack(found)
    return np.asarray(points[shapely.intersects_xy(area, points[:, 0], points[:, 1])])


def _refine(
    point: FloatArray,
    lowest: float,
    shape: FloatArray,
    cost: Cost,
    area: BaseGeometry,
    options: PlaceSearchOptions,
) -> tuple[float, FloatArray]:
    """Look for a cheaper point in the chosen cell on a fine grid; returns its cost and the point."""
    x_min, y_min, x_max, y_max = area.bounds
    steps = options.refinement_steps
    x, y = np.meshgrid(np.linspace(x_min, x_max, steps), np.linspace(y_min, y_max, steps))
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[shapely.contains_xy(area, grid[:, 0], grid[:, 1])]
    if len(grid):
        costs = cost(grid, shape)
        i = int(np.argmin(costs))
        if costs[i] < lowest:
            return float(costs[i]), np.asarray(grid[i])
    return lowest, point


def _weigh_cells(best: list[tuple[float, FloatArray, Cell]]) -> Choice:
    """Turn the costs of cells, lowest first, into candidates with probabilities."""
    logs = np.array([-0.5 * c for c, _, _ in best])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    candidates = tuple(
        Candidate(cell.id, "free place", (Factor("place", float(log)),), float(q), chosen=i == 0)
        for i, ((_, _, cell), log, q) in enumerate(zip(best, logs, p, strict=True))
    )
    return Choice(candidates, candidates[0].id, float(p[0]), Rule.PLACE)
