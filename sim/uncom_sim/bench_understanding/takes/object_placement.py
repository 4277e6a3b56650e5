# SPDX-License-Identifier: Apache-2.0
"""Random places for the objects of a take, such that it can be told what is meant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from uncom_sim.bench_understanding.takes.options import OBJECT_PLACEMENT, ObjectPlacementOptions
from uncom_sim.bench_understanding.takes.types import Scenario
from uncom_sim.objects.footprint import outline
from uncom_sim.types import DIRECTIONS, Point2, Scene, SceneObject, Table
from uncom_sim.world.scene_variation import all_visible

_TARGETS = {
    "in_front_of": ((0.66, 0.86), (-0.38, 0.38)),
    "behind": ((0.50, 0.64), (-0.38, 0.38)),
    "left_of": ((0.50, 0.76), (-0.38, 0.18)),
    "right_of": ((0.50, 0.76), (-0.18, 0.38)),
}


def arrange_objects(
    objects: Sequence[SceneObject],
    relation: str,
    scenario: Scenario,
    rng: np.random.Generator,
    *,
    options: ObjectPlacementOptions = OBJECT_PLACEMENT,
) -> tuple[tuple[SceneObject, ...], Point2 | None] | None:
    """Place objects on the table; the other value is the free place that is meant, for the relation "area".

    None if no arrangement was found in which everything is seen, apart, and what is asked for can be done.
    """
    table = Table()
    placed: list[SceneObject] = []
    shapes: list[shapely.Polygon] = []
    for obj in objects:
        found = _place(obj, shapes, table, rng, *_placement_range(obj.id, relation, options=options), options=options)
        if found is None:
            return None
        placed.append(found)
        shapes.append(outline(found))
    area = _free_place(placed[0], shapes, table, rng, options=options) if relation == "area" else None
    if relation == "area" and area is None:
        return None
    scene = Scene(objects=tuple(placed), say="", table=table)
    if not all_visible(scene):
        return None
    by_id = {obj.id: obj for obj in placed}
    if scenario.target == "relative area" and not _has_room_beside(
        by_id["object"], by_id["target"], placed, relation, options=options
    ):
        return None
    return tuple(placed), area


def place_additional(
    scene: Scene,
    more: Sequence[SceneObject],
    rng: np.random.Generator,
    *,
    options: ObjectPlacementOptions = OBJECT_PLACEMENT,
) -> tuple[SceneObject, ...] | None:
    """Return a scene's objects with more of them in free places, out of the way of what is asked for; None: no room."""
    meant = scene.meaning
    for _ in range(options.tries):
        placed = list(scene.objects)
        shapes = [outline(obj) for obj in placed]
        if meant is not None and meant.area is not None:
            shapes.append(shapely.Point(meant.area).buffer(options.largest_radius_m))
        for obj in more:
            found = _place(obj, shapes, scene.table, rng, options.x_m, (-options.y_m, options.y_m), options=options)
            if found is None:
                break
            placed.append(found)
            shapes.append(outline(found))
        if len(placed) < len(scene.objects) + len(more) or not all_visible(replace(scene, objects=tuple(placed))):
            continue
        by_id = {obj.id: obj for obj in placed}
        sided = meant is not None and meant.target is not None and meant.relation not in ("in", "on")
        if (
            meant is None
            or not sided
            or _has_room_beside(by_id[meant.object], by_id[str(meant.target)], placed, meant.relation, options=options)
        ):
            return tuple(placed)
    return None


def _placement_range(
    name: str, relation: str, *, options: ObjectPlacementOptions = OBJECT_PLACEMENT
) -> tuple[Point2, Point2]:
    """Return the ranges of x and y [m] for an object; a target leaves room on the side where something is to go."""
    if name == "target" and relation in _TARGETS:
        return _TARGETS[relation]
    if name in ("object", "target"):
        return options.reach_x_m, (-options.reach_y_m, options.reach_y_m)
    return options.x_m, (-options.y_m, options.y_m)


def _place(
    obj: SceneObject,
    shapes: Sequence[shapely.Polygon],
    table: Table,
    rng: np.random.Generator,
    x_range: Point2,
    y_range: Point2,
    *,
    options: ObjectPlacementOptions = OBJECT_PLACEMENT,
) -> SceneObject | None:
    top = shapely.box(table.x_min, table.y_min, table.x_max, table.y_max).buffer(-0.01)
    for _ in range(options.tries):
        x, y, yaw = rng.uniform(*x_range), rng.uniform(*y_range), rng.uniform(-np.pi, np.pi)
        moved = replace(obj, x=round(float(x), 4), y=round(float(y), 4), yaw=round(float(yaw), 3))
        shape = outline(moved)
        if top.contains(shape) and all(shape.distance(other) >= options.gap_m for other in shapes):
            return moved
    return None


def radius_of(obj: SceneObject) -> float:
    """Return the radius [m] of the circle about an object's body frame that covers its outline."""
    corners = np.asarray(outline(obj).exterior.coords) - (obj.x, obj.y)
    return float(np.linalg.norm(corners, axis=1).max())


def _free_place(
    obj: SceneObject,
    shapes: Sequence[shapely.Polygon],
    table: Table,
    rng: np.random.Generator,
    *,
    options: ObjectPlacementOptions = OBJECT_PLACEMENT,
) -> Point2 | None:
    radius = min(radius_of(obj), 0.11)
    for _ in range(options.tries):
        x, y = float(rng.uniform(*options.reach_x_m)), float(rng.uniform(-options.reach_y_m, options.reach_y_m))
        away = min(shape.distance(shapely.Point(x, y)) for shape in shapes)
        if away >= max(radius + options.free_m, options.free_radius_m) and table.contains(
            x, y, margin=min(radius, 0.08)
        ):
            return x, y
    return None


def _has_room_beside(
    obj: SceneObject,
    target: SceneObject,
    placed: Sequence[SceneObject],
    relation: str,
    *,
    options: ObjectPlacementOptions = OBJECT_PLACEMENT,
) -> bool:
    """Whether an object fits beside another one, in the direction that is meant."""
    table = Table()
    radius = min(radius_of(obj), options.largest_radius_m)
    others = [outline(other) for other in placed if other.id not in (obj.id, target.id)]
    here = outline(target)
    ways = DIRECTIONS.values() if relation == "next_to" else (DIRECTIONS[relation],)
    for dx, dy in ways:
        edge = _extent(here, target, (dx, dy)) + options.beside_m + radius
        for side in (-0.3, 0.0, 0.3):
            x, y = target.x + edge * (dx - side * dy), target.y + edge * (dy + side * dx)
            spot = shapely.Point(x, y).buffer(radius)
            if table.contains(x, y, margin=radius + options.room_gap_m) and all(
                spot.distance(s) > options.room_gap_m for s in others
            ):
                return True
    return False


def _extent(shape: shapely.Polygon, target: SceneObject, way: Point2) -> float:
    """Return how far an object extends from its body frame in a direction [m]."""
    corners = np.asarray(shape.exterior.coords) - (target.x, target.y)
    return float((corners @ np.asarray(way)).max())
