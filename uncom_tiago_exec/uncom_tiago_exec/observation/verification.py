# SPDX-License-Identifier: Apache-2.0
"""Looking again: is the thing where it should be, and did anything else move?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree
from uncom_perception.types import Detection, Scene

from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.object_shape import shape_of
from uncom_tiago_exec.types import FloatArray, ManipulationTask

NEAR = 0.06  # [m] a thing this near to where it was expected is there
MOVED = 0.02  # [m] bystanders may move this much
_TALL = 1.5  # widths: what is higher falls over
_RISE = 0.01  # [m] what lies in an opening is at least this thick
_SIDEWAYS = ("left_of", "right_of", "in_front_of", "behind")
_WHOLE = 0.85  # of two sights of one thing, an arm hides a part in none if their sizes are as like as this
_MUCH = 0.2  # of the points that were seen of a thing before, of which it is told that it has fallen over
_CELL = 0.01  # [m] of a picture of heights seen from above
_RESTS = 0.5  # share of a thing's upper side that is seen where it was to be
_SAME = 0.10  # [m] a bystander is looked for this far around its old place


@dataclass(frozen=True, slots=True)
class Finding:
    """What the second look says."""

    success: bool
    text: str
    error_m: float | None
    moved: tuple[tuple[str, float], ...]
    measured: Mapping[str, object] = field(default_factory=dict)

    def as_data(self) -> dict[str, object]:
        """Return the finding as the result's JSON has it; lengths in metres."""
        error = None if self.error_m is None or not np.isfinite(self.error_m) else round(self.error_m, 4)
        return {
            "success": self.success,
            "text": self.text,
            "error_m": error,
            **self.measured,
            "moved": dict(self.moved),
        }


def footprint_centre(detection: Detection) -> FloatArray:
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


def verify(task: ManipulationTask, plan: Plan, after: Scene, *, on_target: bool = False) -> Finding:
    """Compare what is seen now with what the plan promised; on_target: it must be seen to rest on the target."""
    finding = _judged(task, plan, after, on_target=on_target)
    measured = _measured(task, plan, after)
    finding = replace(finding, measured=measured)
    away = measured.get("beside_m")
    if finding.success and isinstance(away, float) and away < 0.0:
        relation = task.relation.replace("_", " ")
        text = f"the {task.object_text or 'object'} is not {relation} the {task.target_text or 'other thing'}"
        return replace(finding, success=False, text=text)
    return finding


def _measured(task: ManipulationTask, plan: Plan, after: Scene) -> dict[str, object]:
    """Measure the relation: offset and gap to the target, how far to the right side of it, how high it rests [m]."""
    goal = expected_place(plan)
    seen = [d for d in after.detections if d.geometry is not None and len(d.geometry.cloud)]
    if goal is None or not seen:
        return {"relation": task.relation}
    thing = min(seen, key=lambda d: float(np.linalg.norm(footprint_centre(d) - goal)))
    data: dict[str, object] = {"relation": task.relation}
    if float(np.linalg.norm(footprint_centre(thing) - goal)) < NEAR:
        cloud = _cloud(thing)
        data["bottom_m"] = round(float(np.quantile(cloud[:, 2], 0.02)) - plan.scene.table_z, 4)
    if task.target is None:
        return data
    others = [d for d in seen if d is not thing]
    near = [d for d in others if np.linalg.norm(footprint_centre(d) - footprint_centre(task.target)) < _SAME]
    if near:
        old = footprint_centre(task.target)
        target = min(near, key=lambda d: float(np.linalg.norm(footprint_centre(d) - old)))
        offset = np.subtract(footprint_centre(thing), footprint_centre(target))
        data["offset_m"] = [round(float(v), 4) for v in offset]
        gaps = np.asarray(cKDTree(_cloud(target)[:, :2]).query(_cloud(thing)[:, :2])[0])
        data["gap_m"] = round(float(gaps.min()), 4)
        planned = np.subtract(goal, old)
        if task.relation in _SIDEWAYS:  # towards the side that was planned, whoever's left that is
            data["beside_m"] = round(float(offset @ planned) / max(float(np.linalg.norm(planned)), 1e-6), 4)
    rise = _rise_inside(plan, seen)
    if rise is not None:
        data["rise_inside_m"] = round(rise, 4)
    return data


def _rise_inside(plan: Plan, seen: list[Detection]) -> float | None:
    """Return how much higher than before the inside of an opening is now, at its highest [m]; None without one."""
    target = plan.scene.target
    if target is None or target.rim is None:
        return None
    rim = target.rim
    points = np.vstack([_cloud(d) for d in seen])

    def top(cloud: FloatArray) -> float:
        inside = np.linalg.norm(cloud[:, :2] - rim.centre, axis=1) < 0.6 * rim.radius
        return float(np.quantile(cloud[inside, 2], 0.95)) if inside.sum() > 5 else rim.floor_z

    return top(points) - top(target.visible)


def _cloud(detection: Detection) -> FloatArray:
    if detection.geometry is None:
        return np.zeros((0, 3))
    return np.asarray(detection.geometry.cloud, dtype=float).reshape(-1, 3)


def _judged(task: ManipulationTask, plan: Plan, after: Scene, *, on_target: bool) -> Finding:
    what = task.object_text or task.object.label or "object"
    here = [d for d in after.detections if d.geometry is not None]
    moved = _bystanders(task, here)
    old = footprint_centre(task.object)
    goal = expected_place(plan)
    still_there = _is_there(task.object, here, old)
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
    rise = _rise_inside(plan, here)
    filled = inside and rise is not None and rise > _RISE
    fault = _fault(task, plan, here, goal, on_target=on_target)
    if fault:
        return Finding(False, fault.format(what=what, target=task.target_text or "other thing"), error, moved)
    elsewhere = inside and not filled and error > allowed and len(here) >= len(task.scene)
    if error <= allowed or filled or (inside and not still_there and not elsewhere):
        where = (
            f"in the {task.target_text or 'opening'}" if inside else f"{min(error, 9.9) * 100:.1f} cm from its place"
        )
        return Finding(True, f"the {what} is {where}", error, moved)
    if target is None and _upper_side_seen(plan, here) > _RESTS:  # seen as one with what it stands beside
        return Finding(True, f"the {what} stands at its place", None, moved)
    return Finding(False, f"I do not see the {what} where I put it", error, moved)


def _fault(task: ManipulationTask, plan: Plan, seen: list[Detection], goal: FloatArray, *, on_target: bool) -> str:
    """Return what is wrong with how the thing stands at its place (2,), if anything is."""
    if on_target and not _stands_on(plan, seen, goal):
        return "the {what} is not on the {target}"
    target = plan.scene.target
    return (
        "the {what} has fallen over" if (target is None or target.rim is None) and _lies(task, plan, seen, goal) else ""
    )


def _upper_side_seen(plan: Plan, seen: list[Detection]) -> float:
    """Return which share of the moved thing's upper side is seen, at its height, where the plan brought it."""
    if plan.motion is None or not seen:
        return 0.0
    placed = plan.scene.moved.points @ plan.motion[:3, :3].T + plan.motion[:3, 3]
    cells = np.floor(placed[:, :2] / _CELL).astype(int)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    tops = np.full(int(index.max()) + 1, -np.inf)
    np.maximum.at(tops, index.ravel(), placed[:, 2])
    upper = np.column_stack([(np.unique(cells, axis=0) + 0.5) * _CELL, tops])
    away, _ = cKDTree(np.vstack([_cloud(d) for d in seen])).query(upper)
    return float((np.asarray(away) < 1.5 * _CELL).mean())


def _stands_on(plan: Plan, seen: list[Detection], goal: FloatArray) -> bool:
    """Tell whether something rises above the top of a target at the place (2,), about as high as the thing is."""
    target, thing = plan.scene.target, plan.scene.moved
    if target is None or target.rim is not None:
        return True
    points = np.vstack([_cloud(d) for d in seen]) if seen else np.zeros((0, 3))
    near = points[np.linalg.norm(points[:, :2] - goal, axis=1) < 0.5 * float(thing.size[0]) + 0.01]
    return len(near) > 0 and float(np.quantile(near[:, 2], 0.98)) > target.top + 0.4 * thing.height


def _lies(task: ManipulationTask, plan: Plan, seen: list[Detection], goal: FloatArray) -> bool:
    """Tell whether a thing that stood tall is seen much lower, where the plan brought it (2,)."""
    thing = plan.scene.moved
    if plan.motion is None or thing.height < _TALL * float(thing.size[1]) or not seen:
        return False
    top = float((thing.points @ plan.motion[2, :3] + plan.motion[2, 3]).max())
    points = np.vstack([_cloud(d) for d in seen])
    near = points[np.linalg.norm(points[:, :2] - goal, axis=1) < 0.5 * float(thing.size[0]) + 0.02]
    if len(near) < _MUCH * len(_cloud(task.object)):  # an arm, or the border of the picture, hides the rest
        return False
    return float(near[:, 2].max()) < top - 0.35 * thing.height


def _is_there(thing: Detection, seen: list[Detection], old: FloatArray) -> bool:
    """Tell whether something of like size is seen at a thing's old place."""
    size = visible_extent(thing)
    for other in seen:
        if np.linalg.norm(footprint_centre(other) - old) < 0.02 and 0.6 < visible_extent(other) / max(size, 1e-3) < 1.6:
            return True
    return False


def visible_extent(detection: Detection) -> float:
    """Return the diagonal of the box around what is seen of a thing [m]."""
    if detection.geometry is None or len(detection.geometry.cloud) == 0:
        return 0.0
    return float(np.linalg.norm(np.ptp(np.asarray(detection.geometry.cloud), axis=0)))


def _bystanders(task: ManipulationTask, seen: list[Detection]) -> tuple[tuple[str, float], ...]:
    """Return the other things that moved, with how far; what is not seen again, or in part only, is left out."""
    places = [footprint_centre(d) for d in seen]
    moved = []
    for thing in task.scene:
        if thing.id == task.object.id or (task.target is not None and thing.id == task.target.id):
            continue
        if thing.geometry is None or not places:
            continue
        away = np.linalg.norm(np.array(places) - footprint_centre(thing), axis=1)
        nearest = int(away.argmin())
        whole = _WHOLE < visible_extent(seen[nearest]) / max(visible_extent(thing), 1e-3) < 1.0 / _WHOLE
        if whole and MOVED < float(away[nearest]) < _SAME:
            moved.append((thing.label or thing.id, round(float(away[nearest]), 3)))
    return tuple(moved)
