# SPDX-License-Identifier: Apache-2.0
"""Whether a grounded command is what the person meant: object, action and target, by the simulator's truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from uncom_common.primitive import Primitive
from uncom_perception.types import Detection
from uncom_reasoner.types import GroundedCommand, Status, TargetKind

from uncom_sim.bench_understanding.judging.options import VERDICTS, VerdictOptions
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.objects.footprint import outline
from uncom_sim.scoring.end_state import nearest_object
from uncom_sim.scoring.options import RELATION_CRITERIA
from uncom_sim.types import DIRECTIONS, NEGLIGIBLE, Meaning, ObjectState, Point2, SceneObject, Table

# What may be understood for what is meant: "near" is said of the same places as "next to".
_SAME_RELATION = {"next_to": ("next_to", "near"), "in": ("in",), "on": ("on",)}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came out: ids of the objects that were chosen, the place, and which parts of it are right."""

    status: str
    reason: str
    object: str | None
    target: str | None
    place: Point2 | None
    action: str
    relation: str
    object_right: bool
    action_right: bool
    target_right: bool
    why: str = ""

    @property
    def right(self) -> bool:
        """Whether object, action and target are all as meant."""
        return self.object_right and self.action_right and self.target_right


NOTHING = Verdict("nothing", "nothing was understood", None, None, None, "", "", False, False, False, "no command")


def judge(
    plan: TakePlan,
    states: Sequence[ObjectState],
    grounded: GroundedCommand | None,
    *,
    options: VerdictOptions = VERDICTS,
) -> Verdict:
    """Judge a grounded command (None: there was none)."""
    if grounded is None:
        return NOTHING
    meaning = plan.meaning
    done = grounded.status is Status.GROUNDED
    obj = matched_object_id(grounded.object, states, options=options) if done else None
    target = matched_object_id(grounded.target.detection, states, options=options) if done else None
    area = done and grounded.target.kind is TargetKind.AREA and grounded.target.pose is not None
    pose = grounded.target.pose
    place = (float(pose[0, 3]), float(pose[1, 3])) if area and pose is not None else None
    object_right = obj == meaning.object
    action_right = done and grounded.primitive in plan.actions
    target_right, why = False, grounded.reason
    if done:
        target_right, why = _judge_target(plan, states, grounded, target, place, options=options)
        if not object_right:
            why = f"took {obj or 'nothing that is there'}"
        elif not action_right:
            why = f"would {grounded.primitive.value} it"
    return Verdict(
        grounded.status.name.lower(),
        grounded.reason,
        obj,
        target if place is None else None,
        place,
        grounded.primitive.value,
        grounded.relation,
        object_right,
        action_right,
        target_right,
        "" if object_right and action_right and target_right else why,
    )


def matched_object_id(
    detection: Detection | None, states: Sequence[ObjectState], *, options: VerdictOptions = VERDICTS
) -> str | None:
    """Return the id of the true object that a detection is, or None."""
    if detection is None or detection.geometry is None:
        return None
    x, y = (float(value) for value in detection.geometry.centroid[:2])
    return nearest_object(states, x, y, options.same_place_m)


def _judge_target(
    plan: TakePlan,
    states: Sequence[ObjectState],
    grounded: GroundedCommand,
    target: str | None,
    place: Point2 | None,
    *,
    options: VerdictOptions = VERDICTS,
) -> tuple[bool, str]:
    meaning = plan.meaning
    if meaning.relation in ("in", "on"):
        allowed = ("in", "on", "none") if Primitive.POUR in plan.actions else _SAME_RELATION[meaning.relation]
        if place is not None or target is None:
            return False, "chose a place on the table instead of a thing" if place else "chose no target"
        if target != meaning.target:
            return False, f"chose {target}"
        return grounded.relation in allowed, f"understood {grounded.relation!r}"
    if place is None:
        return False, f"chose {target} instead of a place" if target else "chose no place"
    return place_fits(meaning, states, place, plan.scene.table, options=options)


def place_fits(
    meaning: Meaning, states: Sequence[ObjectState], place: Point2, table: Table, *, options: VerdictOptions = VERDICTS
) -> tuple[bool, str]:
    """Whether a place is in the region that is meant, free of other objects, and big enough; the text says why not."""
    by_id = {state.id: state for state in states}
    obj = scene_object_of(by_id[meaning.object])
    shape = outline(replace(obj, x=place[0], y=place[1]))
    if not table.contains(*place):
        return False, "the place is beside the table"
    for other in states:
        if other.id == meaning.object:
            continue
        if outline(scene_object_of(other)).intersection(shape).area > options.overlap_m2:
            return False, f"the place is taken by {other.id}"
    if meaning.area is not None:
        away = float(np.hypot(place[0] - meaning.area[0], place[1] - meaning.area[1]))
        return away <= RELATION_CRITERIA.area_radius_m, f"{away:.2f} m from the place meant"
    if meaning.target is None:
        return False, "the take means no place"
    return _judge_beside(shape, place, by_id[meaning.target], meaning.relation)


def _judge_beside(shape: shapely.Polygon, place: Point2, target: ObjectState, relation: str) -> tuple[bool, str]:
    gap = float(shape.distance(outline(scene_object_of(target))))
    if relation == "next_to":
        return gap <= RELATION_CRITERIA.near_m, f"{gap:.2f} m from {target.id}"
    offset = np.asarray(place) - target.position[:2]
    length = float(np.linalg.norm(offset))
    if length < NEGLIGIBLE or float(offset @ DIRECTIONS[relation]) / length < RELATION_CRITERIA.cone_cos:
        return False, f"not {relation.replace('_', ' ')} {target.id}"
    return gap <= RELATION_CRITERIA.beside_m, f"{gap:.2f} m from {target.id}"


def scene_object_of(state: ObjectState) -> SceneObject:
    """Return an object as it stands now, as a scene has it."""
    yaw = float(np.arctan2(state.pose[1, 0], state.pose[0, 0]))
    x, y = (float(value) for value in state.position[:2])
    return SceneObject(state.id, state.kind, state.colour, x, y, yaw)
