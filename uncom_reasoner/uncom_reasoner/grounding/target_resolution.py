# SPDX-License-Identifier: Apache-2.0
"""Where the object is to end: a receiving thing or a free place (paper, section III-H).

* a named thing, or "this bowl": as for objects;
* "this", "this thing": a container near the gesture; several: by the posterior, nearest to the ray; none: a free place;
* "here", "there": a free place at the gesture, or the container that it squarely points into;
* left of, next to, between, ... a thing: a free place with that relation in metres;
* a part of the table: a free place in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from shapely.geometry import Point, Polygon
from uncom_common.primitive import Primitive
from uncom_language.types import Command, Reference, Relation
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import (
    CONTAINER,
    any_will_do,
    goes_back,
    is_bare,
    is_place_word,
    is_pronoun,
    is_table,
)
from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, NoPlaceError, NotSupportedError
from uncom_reasoner.grounding.phrasing import spoken
from uncom_reasoner.pointing.pointing_likelihood import table_point
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.object_likelihood import Query, gesture, nearest_z, weigh
from uncom_reasoner.posterior.posterior import NONE, chosen, settle
from uncom_reasoner.support.free_place_search import Cost, Place, find_place
from uncom_reasoner.support.place_costs import (
    AREA_HEADS,
    anywhere_cost,
    area_cost,
    area_words,
    exact_cost,
    pointed_cost,
    related_cost,
)
from uncom_reasoner.support.receptacle import fits_in, opening_of, outline_of
from uncom_reasoner.support.spatial_relations import DIRECTIONAL, RELATIVE, RelationGoal, direction_of
from uncom_reasoner.support.support_plane import centre_of
from uncom_reasoner.types import Cell, Choice, FloatArray, GroundedTarget, PhraseRay, TablePoint, TargetKind

CONTAINER_SHARE = (
    0.3  # a thing is a container if its score is this share of the best one's, and at least LEAST_CONTAINER
)
LEAST_CONTAINER = 0.1
HOLLOW_M = 0.015
ASIDE_M = 0.12  # "move it to the left"


@dataclass(frozen=True)
class TargetResult:
    """A target with what explains it."""

    target: GroundedTarget
    choice: Choice
    point: TablePoint | None = None
    cells: tuple[Cell, ...] = ()
    reference: Choice | None = None  # the thing that a place is relative to
    primitive: Primitive = Primitive.PLACE
    second: Choice | None = None  # the other thing of "between A and B"
    place: FloatArray | None = None  # (2,) centre of the moved footprint, plane coordinates


def resolve_target(command: Command, moved: Detection, ray: PhraseRay, context: Context) -> TargetResult:
    """Find where a command wants its object.

    Raises:
        CannotGroundError: one of its kinds; the text is for the person.
    """
    reference, relation = command.target, command.relation
    if relation is Relation.UNDER:
        raise NotSupportedError("I cannot put things under other things.")
    point = table_point(ray, context.surface, context.evidence.view, context.weights) if ray.present else None
    if reference is None:
        return _back(moved, point, context) if goes_back(command) else _aside(command, moved, point, context)
    if is_place_word(reference) or (relation in (Relation.HERE, Relation.THERE) and is_bare(reference)):
        return _here(moved, ray, point, command, context)
    if is_table(reference) or reference.head.lower() in AREA_HEADS:
        return _on_table(command, reference, moved, point, context)
    if relation in RELATIVE:
        return _relative_to(command, reference, moved, ray, point, context)
    return _receiver(command, reference, moved, ray, point, context)


def _need_table(context: Context) -> None:
    if context.surface.polygon is None:
        raise NoPlaceError("I cannot see a table to put it on.")


def _on_table(
    command: Command, reference: Reference, moved: Detection, point: TablePoint | None, context: Context
) -> TargetResult:
    """The support itself or a part of it: "on the table", "in the corner", "on the left side of the table"."""
    _need_table(context)
    words = area_words(reference, command.relation, command.text)
    if words or not is_table(reference):
        return _place(moved, area_cost(words, context.surface, point), context, point)
    if point is not None:
        return _place(moved, pointed_cost(point, context.surface), context, point)
    return _place(moved, anywhere_cost(centre_of(context.footprints[moved.id]), context.surface), context, point)


def _receiver(
    command: Command, reference: Reference, moved: Detection, ray: PhraseRay, point: TablePoint | None, context: Context
) -> TargetResult:
    """A thing that is to hold the object."""
    query = Query(reference, ray, frozenset((moved.id,)), command.primitive)
    candidates = weigh(query, context)
    answered = "target" in context.evidence.given.among
    if is_bare(reference) and not reference.modifiers:
        if not ray.present and not is_pronoun(reference):
            containers = [c for c in candidates if c.id != NONE and _is_container(c.id, context)]
            if len(containers) != 1 and not answered:
                choices = tuple(c.id for c in containers or candidates if c.id != NONE)
                raise AmbiguousError("I did not see where you pointed.", candidates, choices, "target")
        likeliest = candidates[0].id
        if ray.present and (
            likeliest == NONE or nearest_z(ray, context.thing(likeliest), context) > context.weights.near_ray_z
        ):
            return _pointed_place(moved, point, context)
    choice = settle(candidates, spoken(reference), context.weights, any_will_do=any_will_do(reference, command))
    return _in_thing(command, moved, choice, point, context)


def _in_thing(
    command: Command, moved: Detection, choice: Choice, point: TablePoint | None, context: Context
) -> TargetResult:
    thing = context.thing(choice.chosen)
    if command.primitive is Primitive.PUT_IN and not fits_in(moved, thing, context.surface):
        raise NoPlaceError(f"The {moved.label or 'thing'} does not fit in the {thing.label or 'container'}.")
    opening = opening_of(thing, context.surface)
    outline = outline_of(thing, context.surface)
    pose, area = _posed(opening.centre, opening.height, outline, moved, context)
    target = GroundedTarget(TargetKind.OBJECT, thing, pose, area)
    primitive = command.primitive
    if primitive is Primitive.PLACE:  # "put it here" and the finger was on a thing
        primitive = Primitive.PUT_IN if opening.depth > HOLLOW_M * context.surface.unit else Primitive.PUT_ON
    return TargetResult(target, choice, point, primitive=primitive)


def _is_container(thing_id: str, context: Context) -> bool:
    scores, _ = context.scores(CONTAINER)
    mine = next(s for d, s in zip(context.things, scores, strict=True) if d.id == thing_id)
    return mine >= max(LEAST_CONTAINER, CONTAINER_SHARE * max(scores))


def _here(
    moved: Detection, ray: PhraseRay, point: TablePoint | None, command: Command, context: Context
) -> TargetResult:
    """A place that is pointed at; a container squarely under the ray still is what is meant (paper's rule)."""
    if not ray.present:
        raise AmbiguousError("I did not see where you pointed.", (), (), "target")
    under = []
    for thing in context.things:
        if thing.id == moved.id or not _is_container(thing.id, context):
            continue
        shape = context.footprints[thing.id]
        z = nearest_z(ray, thing, context)
        hit = point is None or shape.is_empty or shape.buffer(0.02 * context.surface.unit).contains(Point(*point.mean))
        if z <= context.weights.under_ray_z and hit:
            under.append((z, thing.id))
    if under and command.target is not None:
        nearest = min(under)[1]
        query = Query(command.target, ray, frozenset((moved.id,)), command.primitive, among=frozenset((nearest,)))
        return _in_thing(command, moved, chosen(weigh(query, context), nearest), point, context)
    return _pointed_place(moved, point, context)


def _pointed_place(moved: Detection, point: TablePoint | None, context: Context) -> TargetResult:
    _need_table(context)
    if point is None:
        raise AmbiguousError("You did not point at a place on the table.", (), (), "target")
    return _place(moved, pointed_cost(point, context.surface), context, point)


def _back(moved: Detection, point: TablePoint | None, context: Context) -> TargetResult:
    """Where the thing was before it was last moved."""
    _need_table(context)
    before = context.memory.before
    if before is None or context.memory.thing is None:
        raise CannotGroundError("I have not moved it, so I do not know where it belongs.")
    where = context.surface.to_plane(before[None, :3, 3])[0, :2]
    return _place(moved, exact_cost(where, context.surface), context, point)


def _aside(command: Command, moved: Detection, point: TablePoint | None, context: Context) -> TargetResult:
    """A side of where the thing is, or is about to be: "move it to the left", "a bit to the left"."""
    _need_table(context)
    shape = context.footprints[moved.id]
    if shape.is_empty or command.relation not in DIRECTIONAL:
        raise CannotGroundError("I did not understand where to put it.")
    start = centre_of(shape)
    if context.evidence.given.start is not None:
        start = context.evidence.given.start
    distance = (command.distance_m or ASIDE_M) * context.surface.unit
    goal = start + distance * direction_of(command.relation, context.surface)
    return _place(moved, exact_cost(goal, context.surface, 0.4 * distance), context, point)


def _relative_to(
    command: Command, reference: Reference, moved: Detection, ray: PhraseRay, point: TablePoint | None, context: Context
) -> TargetResult:
    """A free place with a relation to a thing (or two)."""
    candidates = weigh(Query(reference, ray, frozenset((moved.id,))), context)
    anyone = any_will_do(reference, command) or (command.relation is Relation.BETWEEN and reference.quantity != 1)
    choice = settle(candidates, spoken(reference), context.weights, any_will_do=anyone)
    return _relative(command, moved, point, context, choice.chosen, choice)


def _relative(
    command: Command,
    moved: Detection,
    point: TablePoint | None,
    context: Context,
    anchor_id: str,
    weighed: Choice | None = None,
) -> TargetResult:
    _need_table(context)
    shape = context.footprints[anchor_id]
    second = _second(command, moved, anchor_id, context) if command.relation is Relation.BETWEEN else None
    if shape.is_empty:
        raise NoPlaceError("I cannot tell where on the table that is.")
    other = context.footprints[second.chosen] if second is not None else None
    goal = RelationGoal(command.relation, context.surface, shape, other, command.distance_m)
    result = _place(moved, related_cost(goal, point), context, point)
    return replace(result, reference=weighed, second=second)


def _second(command: Command, moved: Detection, first: str, context: Context) -> Choice:
    reference = command.reference2
    if reference is None:
        return _its_pair(command, moved, first, context)
    ray = gesture("reference2", reference, context)
    candidates = weigh(Query(reference, ray, frozenset((moved.id, first))), context)
    return settle(candidates, spoken(reference), context.weights, part="reference2")


def _its_pair(command: Command, moved: Detection, first: str, context: Context) -> Choice:
    """The other one of "between the plates"."""
    reference = command.target
    if reference is None or reference.quantity == 1:
        raise CannotGroundError("Between which two things? I understood only one of them.")
    ray = PhraseRay("reference2", reference.span.start_s, reference.span.end_s)
    candidates = weigh(Query(reference, ray, frozenset((moved.id, first))), context)
    return settle(candidates, spoken(reference), context.weights, part="reference2")


def _place(moved: Detection, cost: Cost, context: Context, point: TablePoint | None) -> TargetResult:
    shape = context.footprints[moved.id]
    if shape.is_empty:
        raise NoPlaceError("I cannot tell how much room it needs.")
    obstacles: Mapping[str, Polygon] = {k: v for k, v in context.footprints.items() if k != moved.id}
    place: Place = find_place(context.surface, shape, obstacles, cost, context.placing)
    pose, area = _posed(place.centre, 0.0, Polygon(place.cell.polygon), moved, context)
    target = GroundedTarget(TargetKind.AREA, None, pose, area)
    return TargetResult(target, place.choice, point, place.cells, place=place.centre)


def _posed(
    centre: FloatArray, height: float, outline: Polygon, moved: Detection, context: Context
) -> tuple[FloatArray | None, FloatArray]:
    """Return the pose (4, 4) of the moved thing's footprint centre and the outline (N, 3), in the scene's frame.

    The thing keeps the turn that it lies in.
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
