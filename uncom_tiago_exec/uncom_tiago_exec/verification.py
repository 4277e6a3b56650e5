# SPDX-License-Identifier: Apache-2.0
"""Looking again: is the thing where it should be, and did anything else move?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_perception.types import Detection, Scene

from uncom_tiago_exec.plan import Plan
from uncom_tiago_exec.shapes import shape_of
from uncom_tiago_exec.types import FloatArray, ManipulationTask

NEAR = 0.06  # [m] a thing this near to where it was expected is there
MOVED = 0.02  # [m] bystanders may move this much
_SAME = 0.10  # [m] a bystander is looked for this far around its old place


@dataclass(frozen=True, slots=True)
class Finding:
    """What the second look says."""

    success: bool
    text: str
    error_m: float | None
    moved: tuple[tuple[str, float], ...]


def middle_of(detection: Detection) -> FloatArray:
    """Return the middle (2,) of a thing's outline as seen from above."""
    if detection.geometry is None:
        return np.full(2, np.nan)
    cloud = np.asarray(detection.geometry.cloud, dtype=float).reshape(-1, 3)
    if len(cloud) == 0:
        return np.asarray(detection.geometry.pose[:2, 3], dtype=float)
    return np.asarray(0.5 * (np.quantile(cloud[:, :2], 0.02, axis=0) + np.quantile(cloud[:, :2], 0.98, axis=0)))


def expected_place(plan: Plan) -> FloatArray | None:
    """Return where the middle (2,) of the thing should be, or None if it is held."""
    if plan.motion is None:
        return None
    middle = np.append(plan.scene.moved.middle, 1.0)
    return np.asarray((plan.motion @ middle)[:2])


def verify(task: ManipulationTask, plan: Plan, after: Scene) -> Finding:
    """Compare what is seen now with what the plan promised."""
    what = task.object_text or task.object.label or "object"
    here = [d for d in after.detections if d.geometry is not None]
    places = np.array([middle_of(d) for d in here]).reshape(-1, 2)
    moved = _bystanders(task, places)
    old = middle_of(task.object)
    goal = expected_place(plan)
    still_there = bool(len(places)) and _is_there(task.object, here, old)
    if goal is None:
        return Finding(
            not still_there, "it is in my hand" if not still_there else f"the {what} is still there", None, moved
        )
    # the middle of a pan is that of its round part: shapes are completed as they were before the grasp
    middles = np.array([shape_of(d, plan.scene.table_z).middle[:2] for d in here]).reshape(-1, 2)
    error = float(np.linalg.norm(middles - goal, axis=1).min()) if len(middles) else np.inf
    allowed = NEAR
    target = plan.scene.target
    inside = target is not None and target.rim is not None
    if target is not None:
        allowed = max(allowed, float(target.size[0]) / 2.0)
    apart = float(np.linalg.norm(goal - old))
    if still_there and apart > 0.04:
        return Finding(False, f"the {what} is still where it was", error, moved)
    if error <= allowed or (inside and not still_there):
        where = (
            f"in the {task.target_text or 'opening'}" if inside else f"{min(error, 9.9) * 100:.1f} cm from its place"
        )
        return Finding(True, f"the {what} is {where}", error, moved)
    return Finding(False, f"I do not see the {what} where I put it", error, moved)


def _is_there(thing: Detection, seen: list[Detection], old: FloatArray) -> bool:
    """Tell whether something of like size is seen at a thing's old place."""
    size = _extent(thing)
    for other in seen:
        if np.linalg.norm(middle_of(other) - old) < 0.02 and 0.6 < _extent(other) / max(size, 1e-3) < 1.6:
            return True
    return False


def _extent(detection: Detection) -> float:
    if detection.geometry is None or len(detection.geometry.cloud) == 0:
        return 0.0
    return float(np.linalg.norm(np.ptp(np.asarray(detection.geometry.cloud), axis=0)))


def _bystanders(task: ManipulationTask, places: FloatArray) -> tuple[tuple[str, float], ...]:
    """Return the other things that moved, with how far; things not seen again are left out."""
    moved = []
    for thing in task.scene:
        if thing.id == task.object.id or (task.target is not None and thing.id == task.target.id):
            continue
        if thing.geometry is None or not len(places):
            continue
        distance = float(np.linalg.norm(places - middle_of(thing), axis=1).min())
        if MOVED < distance < _SAME:
            moved.append((thing.label or thing.id, round(distance, 3)))
    return tuple(moved)
