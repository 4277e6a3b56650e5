# SPDX-License-Identifier: Apache-2.0
"""One thing, one target, one side that left and right are seen from: the steps of a single decision."""

from __future__ import annotations

from uncom_common.primitive import Primitive
from uncom_language.types import Command, Relation

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import any_will_do, goes_back, is_pronoun, is_unspecific
from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, UnsettledError
from uncom_reasoner.grounding.decision import decision_of
from uncom_reasoner.grounding.phrasing import spoken
from uncom_reasoner.grounding.target_resolution import resolve_target
from uncom_reasoner.pointing.ray_fusion import phrase_span
from uncom_reasoner.posterior.context import Context, context_of
from uncom_reasoner.posterior.discourse_memory import Memory
from uncom_reasoner.posterior.object_likelihood import Query, gesture, weigh
from uncom_reasoner.posterior.posterior import NONE, settle
from uncom_reasoner.types import Candidate, Choice, Decision, Evidence, PhraseRay
from uncom_reasoner.weights import Weights

WITHOUT_TARGET = (Primitive.PICK, Primitive.GIVE, Primitive.POINT)


def ground_once(evidence: Evidence, weights: Weights, placing: PlacingConfig, memory: Memory) -> Decision:
    """Ground a command about one thing, with left and right as the placing's side sees them."""
    context = context_of(evidence, weights, placing, memory)
    command = evidence.command
    rays = gestures_of(command, context)
    try:
        thing_choice = _find_object(command, rays[0], context)
    except CannotGroundError as error:
        candidates = error.candidates if isinstance(error, UnsettledError) else ()
        candidates = candidates or _object_candidates(command, rays[0], context)
        return decision_of(command, context, rays, error, candidates=candidates)
    thing = context.thing(thing_choice.chosen)
    nowhere = command.relation is Relation.NONE and not goes_back(command)
    if command.target is None and (command.primitive in WITHOUT_TARGET or nowhere):
        return decision_of(command, context, rays, None, choice=thing_choice, thing=thing)
    try:
        result = resolve_target(command, thing, rays[1], context)
    except CannotGroundError as error:
        return decision_of(command, context, rays, error, choice=thing_choice, thing=thing)
    return decision_of(command, context, rays, None, thing_choice, thing, result)


def _find_object(command: Command, ray: PhraseRay, context: Context) -> Choice:
    reference = command.object
    if reference is None:
        raise CannotGroundError("I did not understand what to take.")
    if not context.things:
        raise CannotGroundError("I do not see anything on the table.")
    candidates = weigh(Query(reference, ray), context)
    things = [c for c in candidates if c.id != NONE]
    answered = "object" in context.evidence.given.among
    if is_unspecific(reference) and not ray.present and len(things) > 1 and not answered:
        if not is_pronoun(reference):
            choices = tuple(c.id for c in things)
            raise AmbiguousError("I did not see which thing you pointed at.", candidates, choices, "object")
        if not context.memory.places:
            raise CannotGroundError(f"I do not know what you mean by {reference.head!r}. Please name it.")
    return settle(candidates, spoken(reference), context.weights, any_will_do=any_will_do(reference, command))


def gestures_of(command: Command, context: Context) -> tuple[PhraseRay, PhraseRay]:
    """Return the gestures of object and target, each competing with the other for frames between them."""
    references = {"object": command.object, "target": command.target}
    spans = {role: phrase_span(r) for role, r in references.items() if r is not None}
    found = {}
    for role, reference in references.items():
        if reference is None:
            found[role] = PhraseRay(role, 0.0, 0.0)
            continue
        others = [span for other, span in spans.items() if other != role and span != spans[role]]
        found[role] = gesture(role, reference, context, others)
    return found["object"], found["target"]


def _object_candidates(command: Command, ray: PhraseRay, context: Context) -> tuple[Candidate, ...]:
    try:
        return weigh(Query(command.object, ray), context) if command.object is not None else ()
    except CannotGroundError:  # what cannot be weighed has no table either
        return ()
