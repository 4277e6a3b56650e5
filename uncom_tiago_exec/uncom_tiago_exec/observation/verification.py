# SPDX-License-Identifier: Apache-2.0
"""Looking again: is the object where it should be, and did anything else move?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import cKDTree
from uncom_perception.types import Detection, Scene

from uncom_tiago_exec.observation.detection_geometry import (
    distance_between,
    extent_ratio,
    footprint_centre,
    points_of,
)
from uncom_tiago_exec.observation.options import VERIFICATION, VerificationOptions
from uncom_tiago_exec.observation.relation_measurement import expected_place, measure_relation, rise_in_opening
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.object_shape import complete_detection
from uncom_tiago_exec.types import FloatArray, ManipulationTask


@dataclass(frozen=True, slots=True)
class Finding:
    """What looking again says.

    Attributes:
        success: the task is done.
        text: that in words.
        error_m: distance of the object from its expected place [m]; None where that says nothing.
        moved: labels of other objects that moved, with how far [m].
        measured: the relation, measured; see measure_relation.
    """

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


def verify(
    task: ManipulationTask,
    plan: Plan,
    after: Scene,
    *,
    on_target: bool = False,
    options: VerificationOptions = VERIFICATION,
) -> Finding:
    """Compare what is seen now with what a plan promised; everything is in base_footprint.

    Args:
        task: what was to be done, as it was seen before.
        plan: what was carried out.
        after: what is seen now.
        on_target: the object must be seen to rest on the target.
        options: of verification.
    """
    finding = _Verification(task, plan, after, on_target=on_target, options=options).finding()
    measured = measure_relation(task, plan, after.detections, options)
    finding = replace(finding, measured=measured)
    beside = measured.get("beside_m")
    if finding.success and isinstance(beside, float) and beside < 0.0:
        relation = task.relation.replace("_", " ")
        text = f"the {task.object_text or 'object'} is not {relation} the {task.target_text or 'other thing'}"
        return replace(finding, success=False, text=text)
    return finding


class _Verification:
    """One task, what was planned for it, and what is seen afterwards."""

    def __init__(
        self, task: ManipulationTask, plan: Plan, after: Scene, *, on_target: bool, options: VerificationOptions
    ) -> None:
        self._task = task
        self._plan = plan
        self._seen = [d for d in after.detections if d.geometry is not None]
        self._on_target = on_target
        self._options = options

    def finding(self) -> Finding:
        """Return what is found, without the measured relation."""
        task, plan, options = self._task, self._plan, self._options
        name = task.object_text or task.object.label or "object"
        moved, goal, still_there = self._bystanders(), expected_place(plan), self._is_still_there()
        if goal is None:
            text = f"the {name} is still there" if still_there else "it is in my hand"
            return Finding(not still_there, text, None, moved)
        error = self._error(goal)
        if still_there and distance_between(task.object, goal) > options.least_motion_m:
            return Finding(False, f"the {name} is still where it was", error, moved)
        fault = self._fault(goal)
        if fault:
            return Finding(False, fault.format(name=name, target=task.target_text or "other thing"), error, moved)
        if self._is_at_place(error, still_there=still_there):
            where = f"{min(error, options.told_error_m) * 100:.1f} cm from its place"
            text = f"in the {task.target_text or 'opening'}" if self._goes_inside() else where
            return Finding(True, f"the {name} is {text}", error, moved)
        if plan.scene.target is None and self._upper_side_seen() > options.upper_side_ratio:
            return Finding(True, f"the {name} stands at its place", None, moved)  # seen as one with its neighbour
        return Finding(False, f"I do not see the {name} where I put it", error, moved)

    def _error(self, goal: FloatArray) -> float:
        """Return the distance of the nearest object from a place (2,) [m]; infinite if nothing is seen."""
        # The middle of a pan is that of its round part: shapes are completed as they were before the grasp.
        middles = np.array([complete_detection(d, self._plan.scene.table_z).middle[:2] for d in self._seen]).reshape(
            -1, 2
        )
        return float(np.linalg.norm(middles - goal, axis=1).min()) if len(middles) else np.inf

    def _goes_inside(self) -> bool:
        target = self._plan.scene.target
        return target is not None and target.rim is not None

    def _is_at_place(self, error: float, *, still_there: bool) -> bool:
        """Tell whether the object is near enough to its place, or in the opening that it went into."""
        target, options = self._plan.scene.target, self._options
        allowed = options.place_tolerance_m
        if target is not None:
            allowed = max(allowed, float(target.size[0]) / 2.0)
        inside = self._goes_inside()
        rise = rise_in_opening(self._plan, self._seen, options)
        filled = inside and rise is not None and rise > options.rise_m
        elsewhere = inside and not filled and error > allowed and len(self._seen) >= len(self._task.scene)
        return error <= allowed or filled or (inside and not still_there and not elsewhere)

    def _fault(self, goal: FloatArray) -> str:
        """Return what is wrong with how the object stands at its place (2,), if anything is."""
        if self._on_target and not self._stands_on_target(goal):
            return "the {name} is not on the {target}"
        return "the {name} has fallen over" if not self._goes_inside() and self._has_fallen_over(goal) else ""

    def _stands_on_target(self, goal: FloatArray) -> bool:
        """Tell whether something rises above the top of the target at the place (2,), about as high as the object."""
        target, moved, options = self._plan.scene.target, self._plan.scene.moved, self._options
        if target is None or target.rim is not None:
            return True
        near = self._points_around(goal, options.target_margin_m)
        least = target.top + options.on_target_height_ratio * moved.height
        return len(near) > 0 and float(np.quantile(near[:, 2], options.top_quantile)) > least

    def _has_fallen_over(self, goal: FloatArray) -> bool:
        """Tell whether an object that stood tall is seen much lower, where the plan brought it (2,)."""
        moved, motion, options = self._plan.scene.moved, self._plan.motion, self._options
        if motion is None or moved.height < options.tall_ratio * float(moved.size[1]) or not self._seen:
            return False
        top = float((moved.points @ motion[2, :3] + motion[2, 3]).max())
        near = self._points_around(goal, options.fallen_margin_m)
        if len(near) < options.fallen_points_ratio * len(points_of([self._task.object])):
            return False  # an arm, or the border of the picture, hides the rest
        return float(near[:, 2].max()) < top - options.fallen_height_ratio * moved.height

    def _points_around(self, goal: FloatArray, margin: float) -> FloatArray:
        """Return the points (N, 3) seen within the object's radius and a margin [m] of a place (2,)."""
        points, radius = points_of(self._seen), 0.5 * float(self._plan.scene.moved.size[0])
        return np.asarray(points[np.linalg.norm(points[:, :2] - goal, axis=1) < radius + margin])

    def _upper_side_seen(self) -> float:
        """Return which share of the moved object's upper side is seen, at its height, where the plan brought it."""
        motion, cell = self._plan.motion, self._options.cell_m
        if motion is None or not self._seen:
            return 0.0
        placed = self._plan.scene.moved.points @ motion[:3, :3].T + motion[:3, 3]
        cells, index = np.unique(np.floor(placed[:, :2] / cell).astype(int), axis=0, return_inverse=True)
        tops = np.full(int(index.max()) + 1, -np.inf)
        np.maximum.at(tops, index.ravel(), placed[:, 2])
        upper = np.column_stack([(cells + 0.5) * cell, tops])
        away, _ = cKDTree(points_of(self._seen)).query(upper)
        return float((np.asarray(away) < self._options.cell_distance_ratio * cell).mean())

    def _is_still_there(self) -> bool:
        """Tell whether something of like size is seen at the object's old place."""
        old, (least, most) = footprint_centre(self._task.object), self._options.same_extent_ratios
        return any(
            distance_between(other, old) < self._options.same_place_m
            and least < extent_ratio(other, self._task.object) < most
            for other in self._seen
        )

    def _bystanders(self) -> tuple[tuple[str, float], ...]:
        """Return the other objects that moved, with how far; what is not seen again, or in part only, is left out."""
        task, options, moved = self._task, self._options, []
        named = {task.object.id, *(() if task.target is None else (task.target.id,))}
        for other in task.scene:
            if other.id in named or other.geometry is None or not self._seen:
                continue
            nearest, distance = self._nearest(footprint_centre(other))
            whole = options.whole_extent_ratio < extent_ratio(nearest, other) < 1.0 / options.whole_extent_ratio
            if whole and options.moved_m < distance < options.search_radius_m:
                moved.append((other.label or other.id, round(distance, 3)))
        return tuple(moved)

    def _nearest(self, place: FloatArray) -> tuple[Detection, float]:
        """Return what is seen nearest to a place (2,), and how far from it that is [m]."""
        centres = np.array([footprint_centre(detection) for detection in self._seen])
        distances = np.linalg.norm(centres - place, axis=1)
        nearest = int(distances.argmin())
        return self._seen[nearest], float(distances[nearest])
