# SPDX-License-Identifier: Apache-2.0
"""Measures, in a new picture, what the relation of a moved object to its place and its target is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree
from uncom_perception.types import Detection

from uncom_tiago_exec.observation.detection_geometry import distance_between, footprint_centre, points_of
from uncom_tiago_exec.observation.options import VERIFICATION, VerificationOptions
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.types import FloatArray, ManipulationTask

_SIDEWAYS = ("left_of", "right_of", "in_front_of", "behind")


def expected_place(plan: Plan) -> FloatArray | None:
    """Return where the centre (2,) of the moved object should be in base_footprint, or None if it is held."""
    if plan.motion is None:
        return None
    centre = np.append(plan.scene.moved.middle, 1.0)
    return np.asarray((plan.motion @ centre)[:2])


def measure_relation(
    task: ManipulationTask, plan: Plan, detections: Sequence[Detection], options: VerificationOptions = VERIFICATION
) -> dict[str, object]:
    """Return relation, offset_m and gap_m to the target, beside_m, bottom_m over the table, rise_inside_m [m].

    beside_m is the offset towards the side that was planned; what cannot be measured is left out. All is in
    base_footprint.
    """
    goal = expected_place(plan)
    data: dict[str, object] = {"relation": task.relation}
    seen = [d for d in detections if d.geometry is not None and len(d.geometry.cloud)]
    if goal is None or not seen:
        return data
    moved = min(seen, key=lambda d: distance_between(d, goal))
    if distance_between(moved, goal) < options.place_tolerance_m:
        bottom = float(np.quantile(points_of([moved])[:, 2], options.bottom_quantile))
        data["bottom_m"] = round(bottom - plan.scene.table_z, 4)
    if task.target is None:
        return data
    old = footprint_centre(task.target)
    near = [d for d in seen if d is not moved and distance_between(d, old) < options.search_radius_m]
    if near:
        target = min(near, key=lambda d: distance_between(d, old))
        offset = np.subtract(footprint_centre(moved), footprint_centre(target))
        data["offset_m"] = [round(float(v), 4) for v in offset]
        gaps = np.asarray(cKDTree(points_of([target])[:, :2]).query(points_of([moved])[:, :2])[0])
        data["gap_m"] = round(float(gaps.min()), 4)
        planned = np.subtract(goal, old)
        if task.relation in _SIDEWAYS:  # towards the side that was planned, whoever's left that is
            data["beside_m"] = round(float(offset @ planned) / max(float(np.linalg.norm(planned)), 1e-6), 4)
    rise = rise_in_opening(plan, seen, options)
    if rise is not None:
        data["rise_inside_m"] = round(rise, 4)
    return data


def rise_in_opening(
    plan: Plan, detections: Sequence[Detection], options: VerificationOptions = VERIFICATION
) -> float | None:
    """Return how much higher than before the inside of the target's opening is now, at its highest [m].

    None if the target has no opening.
    """
    target = plan.scene.target
    if target is None or target.rim is None:
        return None
    rim = target.rim

    def top(points: FloatArray) -> float:
        inside = np.linalg.norm(points[:, :2] - rim.centre, axis=1) < options.opening_radius_ratio * rim.radius
        if inside.sum() <= options.opening_points:
            return rim.floor_z
        return float(np.quantile(points[inside, 2], options.opening_quantile))

    return top(points_of(detections)) - top(target.visible)
