# SPDX-License-Identifier: Apache-2.0
"""Finding a thing again in a new picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from uncom_perception.types import Detection, Scene, TableSurface

from uncom_tiago_exec.observation.verification import footprint_centre, visible_extent
from uncom_tiago_exec.types import FloatArray, ManipulationTask

_FOLLOW_M = 0.12  # [m] after a failed grasp the thing is looked for this far around its last place
_STILL = 0.03  # [m] a thing nearer than this to where it stood has not moved
_ONE = 0.05  # [m] between the middles of two sightings of one thing
_WHOLE = 0.9  # share of its extent that is seen of what nothing hides
_SAME_HEIGHT = 0.03  # [m] between two sights of one table at most
_LIKE_SIZE = 0.5  # of the logarithm of two sizes


def nearest_detection(scene: Scene, thing: Detection) -> Detection | None:
    """Return what stands nearest to a thing's place, if it is near enough to be the same."""
    place = footprint_centre(thing)
    seen = [d for d in scene.detections if d.geometry is not None]
    near = [(float(np.linalg.norm(footprint_centre(d) - place)), i) for i, d in enumerate(seen)]
    if not near or min(near)[0] > _FOLLOW_M:
        return None
    return seen[min(near)[1]]


def find_object(scene: Scene, task: ManipulationTask, place: FloatArray | None = None) -> Detection | None:
    """Return the thing to move in a new picture: of like size, and not one of the others where it was before.

    It is rather near its old place, or the place (2,) it was to be brought to, than somewhere else.
    """
    size = visible_extent(task.object)
    known = [(footprint_centre(d), visible_extent(d)) for d in _others(task)]
    homes = [footprint_centre(task.object), *([] if place is None else [place])]
    best: tuple[float, Detection] | None = None
    for seen in scene.detections:
        if seen.geometry is None or any(_is_at(seen, *other) for other in known):
            continue
        misfit = abs(float(np.log(max(visible_extent(seen), 1e-3) / max(size, 1e-3))))
        away = min(float(np.linalg.norm(footprint_centre(seen) - home)) for home in homes)
        if away > _FOLLOW_M and misfit > _LIKE_SIZE:
            continue
        if best is None or misfit + away / _FOLLOW_M < best[0]:
            best = (misfit + away / _FOLLOW_M, seen)
    return best[1] if best else None


def _others(task: ManipulationTask) -> list[Detection]:
    """Return everything seen before but the thing to move."""
    things = (*task.scene, *(() if task.target is None else (task.target,)))
    return [d for d in things if d.geometry is not None and d.id != task.object.id]


def _is_at(seen: Detection, place: FloatArray, size: float) -> bool:
    """Tell whether something stands where another thing of like size stood."""
    near = float(np.linalg.norm(footprint_centre(seen) - place)) < _STILL
    return near and abs(float(np.log(max(visible_extent(seen), 1e-3) / max(size, 1e-3)))) < _LIKE_SIZE


def update_task(task: ManipulationTask, scene: Scene, place: FloatArray | None = None) -> ManipulationTask | None:
    """Return a task with everything where it is in a new picture, or None if its thing is not seen; see find_object."""
    thing = find_object(scene, task, place)
    return None if thing is None else _with(task, scene, thing)


def update_task_unobstructed(task: ManipulationTask, scene: Scene) -> ManipulationTask:
    """Return a task with everything as a new picture has it, in which nothing has moved but the arm out of the way.

    What was named may have been seen in part, or as several things; it is what stands nearest there now.
    """
    thing = nearest_detection(scene, task.object)
    return (update_task(task, scene) or task) if thing is None else _with(task, scene, thing)


def _with(task: ManipulationTask, scene: Scene, thing: Detection) -> ManipulationTask:
    target = nearest_detection(scene, task.target) if task.target is not None else None
    table = merge_tables(task.table, scene.table)
    return replace(task, object=thing, scene=scene.detections, table=table, target=target or task.target)


def merge_tables(before: TableSurface | None, now: TableSurface | None) -> TableSurface | None:
    """Return the table as it is seen now, with what was seen of it before: from nearer its near edge is out of sight.

    What was seen at another height was something else.
    """
    if before is None or now is None or abs(before.height_m - now.height_m) > _SAME_HEIGHT:
        return now or before
    corners = np.vstack([np.asarray(before.polygon)[:, :2], np.asarray(now.polygon)[:, :2]])
    outline = cv2.convexHull(corners.astype(np.float32))[:, 0].astype(float)
    return replace(now, polygon=np.column_stack([outline, np.full(len(outline), now.height_m)]))


def with_remembered_objects(now: ManipulationTask, before: ManipulationTask) -> ManipulationTask:
    """Return a task as it is seen now, with what was seen before and is out of sight, or seen in part only, now.

    From nearer that is what stands right before the robot.
    """
    seen = [thing for thing in (*now.scene, now.object) if thing.geometry is not None]
    return replace(now, scene=(*now.scene, *objects_out_of_sight(before, seen, now.target)))


def objects_out_of_sight(
    before: ManipulationTask, seen: Sequence[Detection], target: Detection | None
) -> tuple[Detection, ...]:
    """Return what was seen before, but for the thing to move, and is not among what is seen now as a whole.

    At a target's place nothing is hidden by anything but the target itself.
    """
    hidden = [d for d in before.scene if d.geometry is not None and d.id != before.object.id and not _is_among(d, seen)]
    if target is not None:
        goal = footprint_centre(target)
        hidden = [thing for thing in hidden if float(np.linalg.norm(footprint_centre(thing) - goal)) > _ONE]
    return tuple(replace(thing, id=f"hidden {thing.id}") for thing in hidden)


def _is_among(thing: Detection, seen: Sequence[Detection]) -> bool:
    """Tell whether a thing is seen where it was, and not only a part of it beside an arm."""
    place, whole = footprint_centre(thing), _WHOLE * visible_extent(thing)
    return any(
        float(np.linalg.norm(footprint_centre(other) - place)) < _ONE and visible_extent(other) > whole
        for other in seen
    )
