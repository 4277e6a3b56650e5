# SPDX-License-Identifier: Apache-2.0
"""Where the object is to end: a receiving object or a free place (paper, section III-H).

* a named object, or "this bowl": as for objects;
* "this", "this thing": a container near the gesture; several: by the posterior, nearest to the ray; none: a free place;
* "here", "there": a free place at the gesture, or the container that it squarely points into (container_rule.py);
* left of, next to, between, ... an object: a free place with that relation in metres (place_resolution.py);
* a part of the table: a free place in it.
"""

from __future__ import annotations

from uncom_language.types import Command, Reference, Relation
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import (
    asks_to_return,
    is_bare,
    is_place_word,
    is_pronoun,
    is_table,
    leaves_choice_open,
)
from uncom_reasoner.exceptions import AmbiguousError, NotSupportedError
from uncom_reasoner.gesture_types import PhraseRay, TablePoint
from uncom_reasoner.grounding.container_rule import find_pointed_container, is_container, put_into
from uncom_reasoner.grounding.phrasing import repeat_reference
from uncom_reasoner.grounding.place_resolution import (
    TargetResult,
    place_aside,
    place_at_gesture,
    place_back,
    place_on_table,
    place_relative,
)
from uncom_reasoner.pointing.pointing_likelihood import intersect_table
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.posterior.phrase_gestures import main_dwell_z
from uncom_reasoner.posterior.posterior import NONE, choose, mark_chosen
from uncom_reasoner.support.place_costs import AREA_HEADS
from uncom_reasoner.support.spatial_relations import RELATIVE


def resolve_target(command: Command, moved: Detection, ray: PhraseRay, context: Context) -> TargetResult:
    """Find where a command wants its object.

    Args:
        command: with target and relation.
        moved: the object.
        ray: gesture of the target.
        context: of the decision.

    Raises:
        CannotGroundError: one of its kinds; the text is for the person.
    """
    reference, relation = command.target, command.relation
    if relation is Relation.UNDER:
        raise NotSupportedError("I cannot put things under other things.")
    point = intersect_table(ray, context.surface, context.evidence.view, context.weights) if ray.present else None
    if reference is None:
        if asks_to_return(command):
            return place_back(moved, point, context)
        return place_aside(command, moved, point, context)
    if is_place_word(reference) or (relation in (Relation.HERE, Relation.THERE) and is_bare(reference)):
        return _resolve_here(command, reference, moved, ray, point, context)
    if is_table(reference) or reference.head.lower() in AREA_HEADS:
        return place_on_table(command, reference, moved, point, context)
    if relation in RELATIVE:
        return place_relative(command, reference, moved, ray, point, context)
    return _resolve_receiver(command, reference, moved, ray, point, context)


def _resolve_receiver(
    command: Command, reference: Reference, moved: Detection, ray: PhraseRay, point: TablePoint | None, context: Context
) -> TargetResult:
    """Find the object that is to receive the moved one."""
    query = Query(reference, ray, frozenset((moved.id,)), command.primitive)
    candidates = weigh_candidates(query, context)
    answered = "target" in context.evidence.given.among
    if is_bare(reference) and not reference.modifiers:
        if not ray.present and not is_pronoun(reference):
            containers = [c for c in candidates if c.id != NONE and is_container(c.id, context)]
            if len(containers) != 1 and not answered:
                choices = tuple(c.id for c in containers or candidates if c.id != NONE)
                raise AmbiguousError("I did not see where you pointed.", candidates, choices, "target")
        likeliest = candidates[0].id
        if ray.present and (
            likeliest == NONE or main_dwell_z(ray, context.detection(likeliest), context) > context.weights.near_ray_z
        ):
            return place_at_gesture(moved, point, context)
    any_will_do = leaves_choice_open(reference, command)
    choice = choose(candidates, repeat_reference(reference), context.weights, any_will_do=any_will_do)
    return put_into(command, moved, choice, point, context)


def _resolve_here(
    command: Command, reference: Reference, moved: Detection, ray: PhraseRay, point: TablePoint | None, context: Context
) -> TargetResult:
    """Find the place that is pointed at, or the container that is squarely pointed into."""
    if not ray.present:
        raise AmbiguousError("I did not see where you pointed.", (), (), "target")
    container = find_pointed_container(moved, ray, point, context)
    if not container:
        return place_at_gesture(moved, point, context)
    query = Query(reference, ray, frozenset((moved.id,)), command.primitive, among=frozenset((container,)))
    return put_into(command, moved, mark_chosen(weigh_candidates(query, context), container), point, context)
