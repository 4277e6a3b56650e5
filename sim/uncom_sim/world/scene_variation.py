# SPDX-License-Identifier: Apache-2.0
"""Random variations of a scene: objects are moved, turned and mirrored so that its meaning stays the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np
import shapely

from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import model
from uncom_sim.objects.footprint import outline
from uncom_sim.person.hand_placement import Viewpoint, robot_viewpoint
from uncom_sim.types import DIRECTIONS, Point2, Scene, SceneObject
from uncom_sim.world.options import SCENE_VARIATION, SceneVariationOptions
from uncom_sim.world.placement_check import check_placement


def vary_scene(scene: Scene, seed: int, *, options: SceneVariationOptions = SCENE_VARIATION) -> Scene:
    """Return a scene with its objects in other places; seed 0 leaves them as they are written.

    Everything stays in the camera's sight, apart from everything else, and within reach where it matters.

    Raises:
        SceneError: the scene is so crowded that no other arrangement was found.
    """
    if seed == 0:
        return scene
    rng = np.random.default_rng([seed, 3])
    viewpoint = robot_viewpoint()
    for _ in range(options.attempts):
        changed = _perturb_scene(scene, rng, options=options)
        if _is_valid(changed, viewpoint, options=options):
            return changed
    raise SceneError(f"found no other arrangement of the scene {scene.name!r}; take things off the table or use seed 0")


def _perturb_scene(
    scene: Scene, rng: np.random.Generator, *, options: SceneVariationOptions = SCENE_VARIATION
) -> Scene:
    middle = scene.table.y_min + scene.table.y_max
    mirrored = bool(rng.random() < options.mirrored_share)

    def place(x: float, y: float) -> Point2:
        dx, dy = rng.uniform(-options.shift_m, options.shift_m, 2)
        return float(x + dx), float((middle - y if mirrored else y) + dy)

    def move(obj: SceneObject) -> SceneObject:
        x, y = place(obj.x, obj.y)
        yaw = (-obj.yaw if mirrored else obj.yaw) + float(rng.uniform(-options.turn_rad, options.turn_rad))
        return replace(obj, x=x, y=y, yaw=yaw)

    objects = tuple(move(obj) for obj in scene.objects)
    spots = {p: place(*p) for p in (scene.point_object, scene.point_target) if isinstance(p, tuple)}
    meaning = scene.meaning
    if meaning is not None and meaning.area is not None:
        area = spots.get(meaning.area) or place(*meaning.area)
        meaning = replace(meaning, area=area)
    return replace(
        scene,
        objects=objects,
        point_object=_moved_place(scene.point_object, spots),
        point_target=_moved_place(scene.point_target, spots),
        meaning=meaning,
    )


def _moved_place(pointed: str | Point2 | None, spots: dict[Point2, Point2]) -> str | Point2 | None:
    return spots[pointed] if isinstance(pointed, tuple) else pointed


def _is_valid(scene: Scene, viewpoint: Viewpoint, *, options: SceneVariationOptions = SCENE_VARIATION) -> bool:
    try:
        check_placement(scene.objects, scene.table)
    except SceneError:
        return False
    outlines = {obj.id: outline(obj) for obj in scene.objects}
    if any(a.distance(b) < options.gap_m for a, b in combinations(outlines.values(), 2)):
        return False
    table = shapely.box(scene.table.x_min, scene.table.y_min, scene.table.x_max, scene.table.y_max)
    if not all(table.contains(shape) for shape in outlines.values()):
        return False
    if not all(_reachable(*place, options=options) for place in _places_to_reach(scene, options=options)):
        return False
    if not all(is_visible(obj, scene, viewpoint) for obj in scene.objects):
        return False
    return all(
        shapely.Point(spot).distance(shape) > options.free_radius_m
        for spot in _places_to_keep_free(scene, options=options)
        for name, shape in outlines.items()
        if scene.meaning is None or name not in (scene.meaning.object, scene.meaning.target)
    )


def _reachable(x: float, y: float, *, options: SceneVariationOptions = SCENE_VARIATION) -> bool:
    return options.reach_x_m[0] <= x <= options.reach_x_m[1] and abs(y) <= options.reach_y_m


def _places_to_reach(scene: Scene, *, options: SceneVariationOptions = SCENE_VARIATION) -> Iterator[Point2]:
    """Yield the places where the robot has to pick and put."""
    meaning = scene.meaning
    if meaning is None:
        return
    for name in (meaning.object, meaning.target):
        if name is not None:
            obj = scene.object(name)
            yield (obj.x, obj.y)
    yield from _places_to_keep_free(scene, options=options)


def _places_to_keep_free(scene: Scene, *, options: SceneVariationOptions = SCENE_VARIATION) -> Iterator[Point2]:
    """Yield the places on the bare table where the object is to go."""
    meaning = scene.meaning
    if meaning is None:
        return
    if meaning.area is not None:
        yield meaning.area
    if meaning.target is not None and meaning.relation in DIRECTIONS:
        target, (dx, dy) = scene.object(meaning.target), DIRECTIONS[meaning.relation]
        yield (target.x + options.beside_m * dx, target.y + options.beside_m * dy)


def all_visible(scene: Scene) -> bool:
    """Whether the robot, looking at the table, has every object wholly in its picture and not behind another."""
    viewpoint = robot_viewpoint()
    return all(is_visible(obj, scene, viewpoint) for obj in scene.objects)


def is_visible(obj: SceneObject, scene: Scene, viewpoint: Viewpoint) -> bool:
    """Whether an object is wholly in the picture and nothing nearer stands before its middle."""
    shape = model(obj.kind, obj.colour)
    height = float(shape.size[2])
    ring = np.asarray(outline(obj).exterior.coords)
    corners = np.concatenate(
        [np.column_stack([ring, np.full(len(ring), scene.table.height + z)]) for z in (0.0, height)]
    )
    pixels = viewpoint.pixels(corners)
    margin = SCENE_VARIATION.picture_margin_px
    inside = (pixels > margin).all() and (
        pixels < (viewpoint.camera.width - margin, viewpoint.camera.height - margin)
    ).all()
    if not inside:
        return False
    eye = viewpoint.pose[:3, 3]
    middle = np.array([obj.x, obj.y, scene.table.height + height / 2.0])
    for other in scene.objects:
        if other.id == obj.id:
            continue
        top = scene.table.height + float(model(other.kind, other.colour).size[2])
        share = (top - middle[2]) / (eye[2] - middle[2])
        if share > 0.0:  # the part of the line of sight that runs lower than the other object
            way = shapely.LineString([middle[:2], middle[:2] + min(share, 1.0) * (eye[:2] - middle[:2])])
            if way.distance(outline(other)) < SCENE_VARIATION.sight_gap_m:
                return False
    return True
