# SPDX-License-Identifier: Apache-2.0
"""By way of the middle: what one arm cannot bring all the way is set down where the other arm takes it up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
from uncom_common.primitive import Primitive
from uncom_perception.types import Detection

from uncom_tiago_exec.scene.object_shape import smallest_rectangle
from uncom_tiago_exec.scene.obstacles import is_on_table, make_upright_pose
from uncom_tiago_exec.skills.options import RELAY
from uncom_tiago_exec.types import FloatArray, ManipulationTask


def middle_places(task: ManipulationTask) -> list[FloatArray]:
    """Return a few free places (2,) before the robot where the object can stand, those halfway first."""
    table, geometry = task.table, task.object.geometry
    if table is None or geometry is None or (task.target_pose is None and task.target is None):
        return []
    outline = np.asarray(geometry.cloud, dtype=float)[:, :2]
    middle, _, extent = smallest_rectangle(outline)
    radius = 0.5 * float(extent[0])  # on the table however it is turned
    narrow = 0.5 * float(extent[1])  # beside other objects in one orientation at least; planning finds which
    others = [np.asarray(d.geometry.cloud, dtype=float)[:, :2] for d in _others(task) if d.geometry is not None]
    tree = cKDTree(np.vstack(others)) if others else None
    goal = _goal(task)

    def room(place: FloatArray) -> float:
        return float(tree.query(place)[0]) - narrow if tree is not None else np.inf

    def cost(place: FloatArray) -> float:
        way = float(np.linalg.norm(place - middle) + np.linalg.norm(place - goal))
        return way + abs(float(place[1])) + RELAY.clearance_weight * max(0.0, RELAY.clearance_m - room(place))

    half = 0.5 * (middle + goal)
    places = sorted((np.array([x, y]) for x in RELAY.x_m for y in RELAY.y_m), key=cost)
    found: list[FloatArray] = []
    for place in [*([half] if room(half) >= RELAY.clearance_m else []), *places]:
        if len(found) >= RELAY.most_places:
            break
        if not is_on_table(table, place, radius + 0.02) or any(
            np.linalg.norm(place - p) < RELAY.apart_m for p in found
        ):
            continue
        if (
            min(np.linalg.norm(place - middle), np.linalg.norm(place - goal)) < RELAY.least_way_m
            or room(place) < RELAY.least_clearance_m
        ):
            continue
        found.append(place)
    return found


def to_middle(task: ManipulationTask, place: FloatArray, primitive: Primitive = Primitive.PLACE) -> ManipulationTask:
    """Return the first half: the object to a place (2,) on the table, by a primitive."""
    height = task.table.height_m if task.table is not None else 0.0
    pose = make_upright_pose(np.array([place[0], place[1], height]), 0.0)
    return replace(
        task, primitive=primitive, relation="none", target=None, target_pose=pose, target_text="", scene=_all(task)
    )


def after_moving(task: ManipulationTask, motion: FloatArray) -> ManipulationTask:
    """Return the second half as it will be once the object was moved by `motion` (4, 4)."""
    detection = task.object
    if detection.geometry is None:
        return task
    cloud = np.asarray(detection.geometry.cloud, dtype=float) @ motion[:3, :3].T + motion[:3, 3]
    geometry = replace(
        detection.geometry,
        centroid=cloud.mean(axis=0),
        pose=motion @ detection.geometry.pose,
        cloud=cloud.astype(np.asarray(detection.geometry.cloud).dtype),
    )
    return replace(task, object=replace(detection, geometry=geometry), scene=_others(task))


def _goal(task: ManipulationTask) -> FloatArray:
    if task.target_pose is not None:
        return np.asarray(task.target_pose[:2, 3], dtype=float)
    if task.target is not None and task.target.geometry is not None:
        return np.asarray(task.target.geometry.centroid[:2], dtype=float)
    return np.zeros(2)


def _all(task: ManipulationTask) -> tuple[Detection, ...]:
    """Return everything that was seen, the target among it."""
    if task.target is None or any(d.id == task.target.id for d in task.scene):
        return task.scene
    return (*task.scene, task.target)


def _others(task: ManipulationTask) -> tuple[Detection, ...]:
    return tuple(d for d in _all(task) if d.id != task.object.id)
