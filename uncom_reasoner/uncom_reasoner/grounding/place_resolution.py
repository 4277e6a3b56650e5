# SPDX-License-Identifier: Apache-2.0
"""Free places on the support: on the table, at a gesture, beside an object, aside of or back to where an object was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_common.transforms import FloatArray
from uncom_language.types import Command, Reference, Relation
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import is_table, leaves_choice_open
from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, NoPlaceError
from uncom_reasoner.gesture_types import PhraseRay, TablePoint
from uncom_reasoner.grounding.options import ASIDE, AsideOptions
from uncom_reasoner.grounding.phrasing import repeat_reference
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.posterior.phrase_gestures import find_gesture
from uncom_reasoner.posterior.posterior import choose
from uncom_reasoner.support.free_place_search import NO_TABLE, Cost, find_place
from uncom_reasoner.support.place_costs import (
    anywhere_cost,
    area_cost,
    area_words,
    exact_cost,
    pointed_cost,
    related_cost,
)
from uncom_reasoner.support.spatial_relations import DIRECTIONAL, RelationGoal, relation_direction
from uncom_reasoner.support.support_plane import find_centre
from uncom_reasoner.types import Cell, Choice, GroundedTarget, TargetKind


@dataclass(frozen=True)
class TargetResult:
    """A target with what explains it.

    Attributes:
        target: where the object is to end.
        choice: of the receiving object or of the cell.
        point: where the gesture meets the support.
        cells: the occupancy map.
        reference: the object that a place is relative to; `second` is the other one of "between A and B".
        primitive: what is done for "put": into, onto, or to a free place.
        place: centre (2,) of the moved footprint, plane coordinates.
    """

    target: GroundedTarget
    choice: Choice
    point: TablePoint | None = None
    cells: tuple[Cell, ...] = ()
    reference: Choice | None = None
    primitive: Primitive = Primitive.PLACE
    second: Choice | None = None
    place: FloatArray | None = None


def place_on_table(
    command: Command, reference: Reference, moved: Detection, point: TablePoint | None, context: Context
) -> TargetResult:
    """Find a place on the support or in a part of it: "on the table", "in the corner", "on the left side".

    Raises:
        NoPlaceError: there is none.
    """
    _require_table(context)
    words = area_words(reference, command.relation, command.text)
    if words or not is_table(reference):
        return _search(moved, area_cost(words, context.surface, point), context, point)
    if point is not None:
        return _search(moved, pointed_cost(point, context.surface), context, point)
    return _search(moved, anywhere_cost(find_centre(context.footprints[moved.id]), context.surface), context, point)


def place_at_gesture(moved: Detection, point: TablePoint | None, context: Context) -> TargetResult:
    """Find the place where a gesture meets the support.

    Raises:
        AmbiguousError: it does not meet it.
        NoPlaceError: there is no free place.
    """
    _require_table(context)
    if point is None:
        raise AmbiguousError("You did not point at a place on the table.", (), (), "target")
    return _search(moved, pointed_cost(point, context.surface), context, point)


def place_back(moved: Detection, point: TablePoint | None, context: Context) -> TargetResult:
    """Find the place where the object was before it was last moved.

    Raises:
        CannotGroundError: that is not known, or not free.
    """
    _require_table(context)
    before = context.memory.before
    if before is None or context.memory.detection is None:
        raise CannotGroundError("I have not moved it, so I do not know where it belongs.")
    goal = context.surface.to_plane(before[None, :3, 3])[0, :2]
    return _search(moved, exact_cost(goal, context.surface), context, point)


def place_aside(
    command: Command, moved: Detection, point: TablePoint | None, context: Context, options: AsideOptions = ASIDE
) -> TargetResult:
    """Find a place to a side of where the object is, or is about to be: "move it to the left", "a bit to the left".

    Raises:
        CannotGroundError: the relation is no direction, or there is no free place.
    """
    _require_table(context)
    shape = context.footprints[moved.id]
    if shape.is_empty or command.relation not in DIRECTIONAL:
        raise CannotGroundError("I did not understand where to put it.")
    start = find_centre(shape)
    if context.evidence.given.start is not None:
        start = context.evidence.given.start
    distance = (command.distance_m or options.usual_m) * context.surface.units_per_m
    goal = start + distance * relation_direction(command.relation, context.surface)
    return _search(moved, exact_cost(goal, context.surface, options.tolerance * distance), context, point)


def place_relative(
    command: Command, reference: Reference, moved: Detection, ray: PhraseRay, point: TablePoint | None, context: Context
) -> TargetResult:
    """Find a free place with a relation to an object (or two).

    Raises:
        CannotGroundError: one of its kinds.
    """
    candidates = weigh_candidates(Query(reference, ray, frozenset((moved.id,))), context)
    either = command.relation is Relation.BETWEEN and reference.quantity != 1
    any_will_do = leaves_choice_open(reference, command) or either
    anchor = choose(candidates, repeat_reference(reference), context.weights, any_will_do=any_will_do)
    _require_table(context)
    shape = context.footprints[anchor.chosen]
    second = _choose_second(command, moved, anchor.chosen, context) if command.relation is Relation.BETWEEN else None
    if shape.is_empty:
        raise NoPlaceError("I cannot tell where on the table that is.")
    second_shape = context.footprints[second.chosen] if second is not None else None
    goal = RelationGoal(command.relation, context.surface, shape, second_shape, command.distance_m)
    result = _search(moved, related_cost(goal, point), context, point)
    return replace(result, reference=anchor, second=second)


def _choose_second(command: Command, moved: Detection, first: str, context: Context) -> Choice:
    """Return the object B of "between A and B", or the other one of "between the plates"."""
    reference = command.reference2
    if reference is not None:
        ray = find_gesture("reference2", reference, context)
    else:
        reference = command.target
        if reference is None or reference.quantity == 1:
            raise CannotGroundError("Between which two things? I understood only one of them.")
        ray = PhraseRay("reference2", reference.span.start_s, reference.span.end_s)
    candidates = weigh_candidates(Query(reference, ray, frozenset((moved.id, first))), context)
    return choose(candidates, repeat_reference(reference), context.weights, part="reference2")


def _require_table(context: Context) -> None:
    if context.surface.polygon is None:
        raise NoPlaceError(NO_TABLE)


def _search(moved: Detection, cost: Cost, context: Context, point: TablePoint | None) -> TargetResult:
    shape = context.footprints[moved.id]
    if shape.is_empty:
        raise NoPlaceError("I cannot tell how much room it needs.")
    obstacles: Mapping[str, Polygon] = {k: v for k, v in context.footprints.items() if k != moved.id}
    place = find_place(context.surface, shape, obstacles, cost, context.placing)
    pose, area = pose_on_support(place.centre, 0.0, Polygon(place.cell.polygon), moved, context)
    target = GroundedTarget(TargetKind.AREA, None, pose, area)
    return TargetResult(target, place.choice, point, place.cells, place=place.centre)


def pose_on_support(
    centre: FloatArray, height: float, outline: Polygon, moved: Detection, context: Context
) -> tuple[FloatArray | None, FloatArray]:
    """Return the pose (4, 4) of the moved object's footprint centre and the outline (N, 3), in the scene's frame.

    The object keeps the turn that it lies in. Without depth there is no pose, and the outline is in pixels.

    Args:
        centre: (2,) of the footprint, plane coordinates.
        height: above the support [m].
        outline: of the target, plane coordinates.
        moved: the object.
        context: of the decision.
    """
    surface = context.surface
    area = surface.to_scene(np.asarray(outline.exterior.coords)[:-1], height)
    if not surface.metric:
        return None, area
    pose = np.eye(4)
    if moved.geometry is not None:
        pose[:3, :3] = moved.geometry.pose[:3, :3]
    pose[:3, 3] = surface.to_scene(centre, height)[0]
    return pose, area
