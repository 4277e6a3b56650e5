# SPDX-License-Identifier: Apache-2.0
"""Criteria for the end state: the object is where it was to go, and everything else is where it was.

Left, right, in front and behind are as the robot sees them: left is +y, right -y, in front -x, behind +x.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import model
from uncom_sim.objects.footprint import outline
from uncom_sim.scoring.options import END_STATE, RELATION_CRITERIA, EndStateCriteria, RelationCriteria
from uncom_sim.types import DIRECTIONS, NEGLIGIBLE, Meaning, ObjectState, Point2, SceneObject, Table

_LYING_KINDS = ("banana", "apple", "lemon", "orange", "pear", "spoon")  # any way up


@dataclass(frozen=True, slots=True)
class PhysicalResult:
    """The outcome: in words, and how far the object and the most moved other object went [m]."""

    success: bool
    reason: str
    object_moved_m: float
    others_moved_m: float

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as the demo's JSON has them."""
        return {
            "success": self.success,
            "reason": self.reason,
            "object_moved_m": round(self.object_moved_m, 4),
            "others_moved_m": round(self.others_moved_m, 4),
        }


def nearest_object(states: Sequence[ObjectState], x: float, y: float, within_m: float = 0.10) -> str | None:
    """Return the id of the object at a place (x, y) [m], or None when the next one is farther than within_m.

    The distance is to the outline, so that a long handle or a curved banana does not matter; of several that cover the
    place (a lemon in a bowl) it is the one whose middle is nearest.
    """
    place = shapely.Point(x, y)
    best: tuple[float, float, str] | None = None
    for state in states:
        gap = float(_outline(state).distance(place))
        key = (gap, float(np.hypot(*(state.position[:2] - (x, y)))), state.id)
        if gap <= within_m and (best is None or key < best):
            best = key
    return None if best is None else best[2]


def judge(
    before: Sequence[ObjectState],
    after: Sequence[ObjectState],
    goal: Meaning,
    table: Table,
    *,
    end_state_criteria: EndStateCriteria = END_STATE,
    relation_criteria: RelationCriteria = RELATION_CRITERIA,
) -> PhysicalResult:
    """Compare the world before and after with what was to happen.

    Args:
        before: where everything was.
        after: where everything is once it has come to rest.
        goal: what was to happen; relation "none" is: lift the object.
        table: the table.
        end_state_criteria: what must hold at the end.
        relation_criteria: when something is near, beside or at a place.

    Raises:
        SceneError: the goal names an object that is not there.
    """
    was, now = _by_id(before), _by_id(after)
    for name in (goal.object, goal.target):
        if name is not None and (name not in was or name not in now):
            raise SceneError(f"there is no object {name!r} to judge; objects are: {', '.join(now)}")
    moved = {i: float(np.linalg.norm(now[i].position - was[i].position)) for i in now if i in was}
    others = max(((moved[i], i) for i in moved if i not in (goal.object, goal.target)), default=(0.0, ""))
    target_moved = 0.0 if goal.target is None else moved[goal.target]
    success, reason = _goal_reached(
        was, now, goal, table, end_state_criteria=end_state_criteria, relation_criteria=relation_criteria
    )
    if success and others[0] > end_state_criteria.moved_m:
        success, reason = False, f"{reason}, but {others[1]} was moved by {others[0]:.2f} m"
    if success and target_moved > 2 * end_state_criteria.moved_m:
        success, reason = False, f"{reason}, but {goal.target} was moved by {target_moved:.2f} m"
    return PhysicalResult(success, reason, moved[goal.object], max(others[0], target_moved))


def _goal_reached(
    was: Mapping[str, ObjectState],
    now: Mapping[str, ObjectState],
    goal: Meaning,
    table: Table,
    *,
    end_state_criteria: EndStateCriteria = END_STATE,
    relation_criteria: RelationCriteria = RELATION_CRITERIA,
) -> tuple[bool, str]:
    obj = now[goal.object]
    rise = float(obj.position[2] - was[goal.object].position[2])
    if obj.position[2] < table.height - end_state_criteria.fallen_m:
        return False, f"{goal.object} fell off the table"
    if goal.relation == "none":
        return (
            rise > end_state_criteria.lifted_m,
            f"{goal.object} was {'' if rise > end_state_criteria.lifted_m else 'not '}lifted",
        )
    reached, reason = _check_relation(
        obj, goal, now, table, end_state_criteria=end_state_criteria, relation_criteria=relation_criteria
    )
    if (
        reached
        and obj.kind not in _LYING_KINDS
        and obj.pose[2, 2] < end_state_criteria.upright_cos <= was[goal.object].pose[2, 2]
    ):
        return False, f"{reason}, but it was tipped over"
    return reached, reason


def _check_relation(
    obj: ObjectState,
    goal: Meaning,
    now: Mapping[str, ObjectState],
    table: Table,
    *,
    end_state_criteria: EndStateCriteria = END_STATE,
    relation_criteria: RelationCriteria = RELATION_CRITERIA,
) -> tuple[bool, str]:
    if goal.relation == "area":
        return _in_area(obj, goal.area, table, relation_criteria=relation_criteria)
    if goal.target is None:
        raise SceneError(f"a goal with the relation {goal.relation!r} needs a target")
    target = now[goal.target]
    if goal.relation == "in" and model(target.kind, target.colour).opening is not None:
        return _inside(obj, target, end_state_criteria=end_state_criteria)
    if goal.relation in ("in", "on"):
        return _on_top(obj, target, end_state_criteria=end_state_criteria)
    return _beside(obj, target, goal.relation, table, relation_criteria=relation_criteria)


def _inside(
    obj: ObjectState,
    target: ObjectState,
    over_rim_m: float = -0.003,
    *,
    end_state_criteria: EndStateCriteria = END_STATE,
) -> tuple[bool, str]:
    """Within the opening, and its underside no more than over_rim_m above the rim: not lying across it."""
    opening = model(target.kind, target.colour).opening
    if opening is None:
        return _on_top(obj, target, end_state_criteria=end_state_criteria)
    if target.pose[2, 2] < end_state_criteria.upright_cos:
        return False, f"{target.id} was tipped over"
    place = target.pose[:3, :3].T @ (obj.position - target.position)
    away = float(np.hypot(place[0] - opening.centre[0], place[1] - opening.centre[1]))
    # what leans in a bowl reaches down by its thinnest side; what stands on a plate by half its height
    half = max(float(np.min(obj.size)) / 2.0, float(obj.position[2]) - _heights(obj)[0] if over_rim_m > 0.0 else 0.0)
    above = float(place[2]) - half - opening.rim_z
    if away > opening.radius or above > over_rim_m:
        return False, f"{obj.id} is not in {target.id}: {away:.2f} m from its middle"
    return True, f"{obj.id} is in {target.id}"


def _on_top(
    obj: ObjectState, target: ObjectState, *, end_state_criteria: EndStateCriteria = END_STATE
) -> tuple[bool, str]:
    shape = model(target.kind, target.colour)
    if shape.opening is not None:
        held, reason = _inside(
            obj, target, over_rim_m=end_state_criteria.over_rim_m, end_state_criteria=end_state_criteria
        )
        return held, reason.replace(" in ", " on ")
    rests_at, top = _heights(obj)[0], _heights(target)[1]
    over = bool(_outline(target).buffer(0.01).contains(shapely.Point(*obj.position[:2])))
    if not over or abs(rests_at - top) > end_state_criteria.over_rim_m:
        return False, f"{obj.id} is not on {target.id}"
    return True, f"{obj.id} is on {target.id}"


def _beside(
    obj: ObjectState,
    target: ObjectState,
    relation: str,
    table: Table,
    *,
    relation_criteria: RelationCriteria = RELATION_CRITERIA,
) -> tuple[bool, str]:
    if not _stands_on(obj, table):
        return False, f"{obj.id} does not lie on the table"
    words = relation.replace("_", " ").replace("in front", "in front")
    gap = float(_outline(obj).distance(_outline(target)))
    if relation == "next_to":
        return gap <= relation_criteria.near_m, f"{obj.id} is {gap:.2f} m from {target.id}"
    offset = obj.position[:2] - target.position[:2]
    length = float(np.linalg.norm(offset))
    if length < NEGLIGIBLE or float(offset @ DIRECTIONS[relation]) / length < relation_criteria.cone_cos:
        return False, f"{obj.id} is not {words} {target.id}"
    if gap > relation_criteria.beside_m:
        return False, f"{obj.id} is {gap:.2f} m from {target.id}, too far to be called {words} it"
    return True, f"{obj.id} is {words} {target.id}, {gap:.2f} m away"


def _in_area(
    obj: ObjectState, area: Point2 | None, table: Table, *, relation_criteria: RelationCriteria = RELATION_CRITERIA
) -> tuple[bool, str]:
    if area is None:
        raise SceneError("a goal with the relation 'area' needs an area")
    away = float(np.hypot(*(obj.position[:2] - area)))
    if not _stands_on(obj, table):
        return False, f"{obj.id} does not lie on the table"
    return away <= relation_criteria.area_radius_m, f"{obj.id} is {away:.2f} m from the place meant"


def _stands_on(obj: ObjectState, table: Table, options: EndStateCriteria = END_STATE) -> bool:
    gap = abs(_heights(obj)[0] - table.height)
    return table.contains(*map(float, obj.position[:2])) and gap < options.lying_m


def _heights(state: ObjectState) -> tuple[float, float]:
    """Heights of the lowest and the highest point of an object as it lies now [m]."""
    heights = np.concatenate(model(state.kind, state.colour).hulls) @ state.pose[2, :3] + state.position[2]
    return float(heights.min()), float(heights.max())


def _outline(state: ObjectState) -> shapely.Polygon:
    yaw = float(np.arctan2(state.pose[1, 0], state.pose[0, 0]))
    x, y = map(float, state.position[:2])
    return outline(SceneObject(state.id, state.kind, state.colour, x, y, yaw))


def _by_id(states: Sequence[ObjectState]) -> dict[str, ObjectState]:
    return {state.id: state for state in states}
