# SPDX-License-Identifier: Apache-2.0
"""Finding the objects of a task again in a new picture. Task and scene are in one frame, whichever it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from uncom_perception.types import Detection, Scene, TableSurface

from uncom_tiago_exec.observation.detection_geometry import (
    distance_between,
    extent_misfit,
    footprint_centre,
    visible_extent,
)
from uncom_tiago_exec.observation.options import REIDENTIFICATION, ReidentificationOptions
from uncom_tiago_exec.types import FloatArray, ManipulationTask


def update_task(
    task: ManipulationTask,
    scene: Scene,
    place: FloatArray | None = None,
    options: ReidentificationOptions = REIDENTIFICATION,
) -> ManipulationTask | None:
    """Return a task with everything where it is in a new picture, or None if its object is not seen; see find_object.

    Args:
        task: as it was known before.
        scene: what is seen now.
        place: where the object (2,) was to be brought to, if it was.
        options: of reidentification.
    """
    found = find_object(scene, task, place, options)
    return None if found is None else _with_scene(task, scene, found, options)


def update_task_unobstructed(
    task: ManipulationTask, scene: Scene, options: ReidentificationOptions = REIDENTIFICATION
) -> ManipulationTask:
    """Return a task with everything as a new picture has it, in which nothing has moved but the arm out of the way.

    What was named may have been seen in part, or as several objects; it is what stands nearest there now.
    """
    found = _nearest(scene, task.object, options)
    if found is None:
        return update_task(task, scene, options=options) or task
    return _with_scene(task, scene, found, options)


def find_object(
    scene: Scene,
    task: ManipulationTask,
    place: FloatArray | None = None,
    options: ReidentificationOptions = REIDENTIFICATION,
) -> Detection | None:
    """Return the object of a task in a new picture, or None if it is not seen.

    It has a like extent, is none of the others where it was before, and is rather near its old place, or the place
    (2,) it was to be brought to, than somewhere else.
    """
    extent = visible_extent(task.object)
    others = [(footprint_centre(d), visible_extent(d)) for d in _others(task)]
    homes = [footprint_centre(task.object), *([] if place is None else [place])]
    best: tuple[float, Detection] | None = None
    for seen in scene.detections:
        if seen.geometry is None or any(_is_at(seen, *other, options) for other in others):
            continue
        misfit = extent_misfit(seen, extent)
        away = min(distance_between(seen, home) for home in homes)
        if away > options.search_radius_m and misfit > options.extent_misfit:
            continue
        cost = misfit + away / options.search_radius_m
        if best is None or cost < best[0]:
            best = (cost, seen)
    return best[1] if best else None


def merge_tables(
    before: TableSurface | None, now: TableSurface | None, options: ReidentificationOptions = REIDENTIFICATION
) -> TableSurface | None:
    """Return the table as it is seen now, with what was seen of it before: from nearer its near edge is out of sight.

    What was seen at another height was something else.
    """
    if before is None or now is None or abs(before.height_m - now.height_m) > options.table_height_m:
        return now or before
    corners = np.vstack([np.asarray(before.polygon)[:, :2], np.asarray(now.polygon)[:, :2]])
    outline = cv2.convexHull(corners.astype(np.float32))[:, 0].astype(float)
    return replace(now, polygon=np.column_stack([outline, np.full(len(outline), now.height_m)]))


def with_remembered_objects(
    now: ManipulationTask, before: ManipulationTask, options: ReidentificationOptions = REIDENTIFICATION
) -> ManipulationTask:
    """Return a task as it is seen now, with what was seen before and is out of sight, or seen in part only, now.

    From nearer that is what stands right before the robot.
    """
    seen = [d for d in (*now.scene, now.object) if d.geometry is not None]
    return replace(now, scene=(*now.scene, *objects_out_of_sight(before, seen, now.target, options)))


def objects_out_of_sight(
    before: ManipulationTask,
    seen: Sequence[Detection],
    target: Detection | None,
    options: ReidentificationOptions = REIDENTIFICATION,
) -> tuple[Detection, ...]:
    """Return what was seen before, but for the object to move, and is not among what is seen now as a whole.

    At a target's place nothing is hidden by anything but the target itself.
    """
    hidden = [
        d
        for d in before.scene
        if d.geometry is not None and d.id != before.object.id and not _is_among(d, seen, options)
    ]
    if target is not None:
        goal = footprint_centre(target)
        hidden = [d for d in hidden if distance_between(d, goal) > options.same_object_m]
    return tuple(replace(d, id=f"hidden {d.id}") for d in hidden)


def _nearest(scene: Scene, before: Detection, options: ReidentificationOptions) -> Detection | None:
    """Return what stands nearest to an object's place, if it is near enough to be the same."""
    place = footprint_centre(before)
    seen = [d for d in scene.detections if d.geometry is not None]
    distances = [distance_between(d, place) for d in seen]
    if not distances or min(distances) > options.search_radius_m:
        return None
    return seen[distances.index(min(distances))]


def _with_scene(
    task: ManipulationTask, scene: Scene, found: Detection, options: ReidentificationOptions
) -> ManipulationTask:
    """Return a task whose object is a detection of a new scene, with the scene's other objects and its table."""
    target = _nearest(scene, task.target, options) if task.target is not None else None
    table = merge_tables(task.table, scene.table, options)
    return replace(task, object=found, scene=scene.detections, table=table, target=target or task.target)


def _others(task: ManipulationTask) -> list[Detection]:
    """Return everything seen before but the object to move."""
    detections = (*task.scene, *(() if task.target is None else (task.target,)))
    return [d for d in detections if d.geometry is not None and d.id != task.object.id]


def _is_at(seen: Detection, place: FloatArray, extent: float, options: ReidentificationOptions) -> bool:
    """Tell whether something stands where another object of like extent stood."""
    return distance_between(seen, place) < options.still_m and extent_misfit(seen, extent) < options.extent_misfit


def _is_among(before: Detection, seen: Sequence[Detection], options: ReidentificationOptions) -> bool:
    """Tell whether an object is seen where it was, and not only a part of it beside an arm."""
    place, whole = footprint_centre(before), options.whole_extent_ratio * visible_extent(before)
    return any(distance_between(d, place) < options.same_object_m and visible_extent(d) > whole for d in seen)
