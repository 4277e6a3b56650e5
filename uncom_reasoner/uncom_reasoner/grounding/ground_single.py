# SPDX-License-Identifier: Apache-2.0
"""One object, one target, one side that left and right are seen from: the steps of a single decision."""

from __future__ import annotations

from uncom_common.primitive import Primitive
from uncom_language.types import Command, Relation

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import asks_to_return, is_pronoun, is_unspecific, leaves_choice_open
from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, UnsettledError
from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.grounding.decision import build_decision
from uncom_reasoner.grounding.phrasing import repeat_reference
from uncom_reasoner.grounding.target_resolution import resolve_target
from uncom_reasoner.pointing.ray_fusion import phrase_span
from uncom_reasoner.posterior.context import Context, build_context
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.posterior.phrase_gestures import find_gesture
from uncom_reasoner.posterior.posterior import NONE, choose
from uncom_reasoner.types import Candidate, Choice, Decision, Evidence
from uncom_reasoner.weights import Weights

WITHOUT_TARGET = (Primitive.PICK, Primitive.GIVE, Primitive.POINT)


def ground_once(evidence: Evidence, weights: Weights, placing: PlacingConfig, memory: DiscourseMemory) -> Decision:
    """Ground a command about one object, with left and right as the placing's side sees them.

    Args:
        evidence: that it is decided on.
        weights: of the posterior.
        placing: how places are chosen.
        memory: of what was spoken of before.
    """
    context = build_context(evidence, weights, placing, memory)
    command = evidence.command
    rays = find_gestures(command, context)
    try:
        object_choice = _find_object(command, rays[0], context)
    except CannotGroundError as error:
        candidates = error.candidates if isinstance(error, UnsettledError) else ()
        candidates = candidates or _weigh_object(command, rays[0], context)
        return build_decision(command, context, rays, error, candidates=candidates)
    detection = context.detection(object_choice.chosen)
    placeless = command.relation is Relation.NONE and not asks_to_return(command)
    if command.target is None and (command.primitive in WITHOUT_TARGET or placeless):
        return build_decision(command, context, rays, None, choice=object_choice, detection=detection)
    try:
        result = resolve_target(command, detection, rays[1], context)
    except CannotGroundError as error:
        return build_decision(command, context, rays, error, choice=object_choice, detection=detection)
    return build_decision(command, context, rays, None, object_choice, detection, result)


def _find_object(command: Command, ray: PhraseRay, context: Context) -> Choice:
    reference = command.object
    if reference is None:
        raise CannotGroundError("I did not understand what to take.")
    if not context.detections:
        raise CannotGroundError("I do not see anything on the table.")
    candidates = weigh_candidates(Query(reference, ray), context)
    objects = [c for c in candidates if c.id != NONE]
    answered = "object" in context.evidence.given.among
    if is_unspecific(reference) and not ray.present and len(objects) > 1 and not answered:
        if not is_pronoun(reference):
            choices = tuple(c.id for c in objects)
            raise AmbiguousError("I did not see which thing you pointed at.", candidates, choices, "object")
        if not context.memory.places:
            raise CannotGroundError(f"I do not know what you mean by {reference.head!r}. Please name it.")
    return choose(
        candidates, repeat_reference(reference), context.weights, any_will_do=leaves_choice_open(reference, command)
    )


def find_gestures(command: Command, context: Context) -> tuple[PhraseRay, PhraseRay]:
    """Return the gestures of object and target, each competing with the other for frames between them."""
    references = {"object": command.object, "target": command.target}
    spans = {role: phrase_span(r) for role, r in references.items() if r is not None}
    found = {}
    for role, reference in references.items():
        if reference is None:
            found[role] = PhraseRay(role, 0.0, 0.0)
            continue
        other_spans = [span for other, span in spans.items() if other != role and span != spans[role]]
        found[role] = find_gesture(role, reference, context, other_spans)
    return found["object"], found["target"]


def _weigh_object(command: Command, ray: PhraseRay, context: Context) -> tuple[Candidate, ...]:
    try:
        return weigh_candidates(Query(command.object, ray), context) if command.object is not None else ()
    except CannotGroundError:  # what cannot be weighed has no table either
        return ()
