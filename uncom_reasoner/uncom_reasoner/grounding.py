# SPDX-License-Identifier: Apache-2.0
"""From a command, the hands and the scene to a grounded command: the facade of this package."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from uncom_language.types import Command, Primitive, Relation
from uncom_perception.types import Detection

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.context import Context, context_of
from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, NotSupportedError, UnsettledError
from uncom_reasoner.memory import Memory
from uncom_reasoner.phrases import any_will_do, is_bare, is_pronoun
from uncom_reasoner.posterior import NONE, settle
from uncom_reasoner.rays import phrase_span
from uncom_reasoner.targets import TargetResult, resolve_target
from uncom_reasoner.things import Query, gesture, weigh
from uncom_reasoner.types import (
    Candidate,
    Choice,
    Counterfactual,
    Decision,
    Evidence,
    GroundedCommand,
    PhraseRay,
    Status,
)
from uncom_reasoner.weights import Weights, load_weights
from uncom_reasoner.wording import described, spoken, target_text

WITHOUT_TARGET = (Primitive.PICK, Primitive.GIVE, Primitive.POINT)


def ground(
    evidence: Evidence,
    weights: Weights | None = None,
    placing: PlacingConfig | None = None,
    memory: Memory | None = None,
) -> Decision:
    """Ground a command (Act.COMMAND). What a person says or shows wrongly is told by status and reason.

    Args:
        evidence: command, scene (detected with `phrases.phrases_of(command)`), camera and rays (`rays.observe`).
        weights: of the posterior; None: the shipped ones.
        placing: how places are chosen; None: the defaults.
        memory: of what was spoken of before.

    Raises:
        NotSupportedError: a thing is located by comparing it with another ("with the same colour as this").
    """
    context = context_of(evidence, weights or load_weights(), placing or PlacingConfig(), memory or Memory())
    command = evidence.command
    object_ray, target_ray = _gestures(command, context)
    try:
        thing_choice = _find_object(command, object_ray, context)
    except CannotGroundError as error:
        candidates = error.candidates if isinstance(error, UnsettledError) else ()
        candidates = candidates or _object_candidates(command, object_ray, context)
        return _decision(command, context, (object_ray, target_ray), error, candidates=candidates)
    thing = context.thing(thing_choice.chosen)
    if command.target is None and (command.primitive in WITHOUT_TARGET or command.relation is Relation.NONE):
        return _decision(command, context, (object_ray, target_ray), None, choice=thing_choice, thing=thing)
    try:
        result = resolve_target(command, thing, target_ray, context)
    except CannotGroundError as error:
        return _decision(command, context, (object_ray, target_ray), error, choice=thing_choice, thing=thing)
    return _decision(command, context, (object_ray, target_ray), None, thing_choice, thing, result)


def failed(command: Command, reason: str) -> GroundedCommand:
    """Return a grounded command that failed before anything was looked at."""
    return GroundedCommand(
        stamp_s=0.0,
        frame_id="",
        utterance_id=command.utterance_id,
        index=command.index,
        status=Status.FAILED,
        reason=reason,
        object_text=described(command.object),
        action_text=command.action_text,
        target_text=target_text(command),
        primitive=command.primitive.value,
        relation=command.relation.value,
    )


def _gestures(command: Command, context: Context) -> tuple[PhraseRay, PhraseRay]:
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


def _find_object(command: Command, ray: PhraseRay, context: Context) -> Choice:
    reference = command.object
    if reference is None:
        raise CannotGroundError("I did not understand what to take.")
    if reference.quantity != 1:
        raise NotSupportedError("I can take only one thing at a time. Please name one.")
    if not context.things:
        raise CannotGroundError("I do not see anything on the table.")
    candidates = weigh(Query(reference, ray), context)
    things = [c for c in candidates if c.id != NONE]
    if is_bare(reference) and not reference.modifiers and not ray.present and len(things) > 1:
        if not is_pronoun(reference):
            raise CannotGroundError("I did not see which thing you pointed at.")
        if not context.memory.places:
            raise CannotGroundError(f"I do not know what you mean by {reference.head!r}. Please name it.")
    return settle(candidates, spoken(reference), context.weights, any_will_do=any_will_do(reference, command))


def _object_candidates(command: Command, ray: PhraseRay, context: Context) -> tuple[Candidate, ...]:
    return weigh(Query(command.object, ray), context) if command.object is not None else ()


def _decision(
    command: Command,
    context: Context,
    rays: tuple[PhraseRay, PhraseRay],
    error: CannotGroundError | None,
    choice: Choice | None = None,
    thing: Detection | None = None,
    result: TargetResult | None = None,
    candidates: tuple[Candidate, ...] = (),
) -> Decision:
    evidence = context.evidence
    status = Status.GROUNDED
    if error is not None:
        status = Status.AMBIGUOUS if isinstance(error, AmbiguousError) else Status.FAILED
    receiver = result.target.detection.id if result is not None and result.target.detection is not None else ""
    grounded = GroundedCommand(
        stamp_s=evidence.scene.stamp_s,
        frame_id=evidence.scene.frame_id,
        utterance_id=command.utterance_id,
        index=command.index,
        status=status,
        reason=str(error) if error is not None else "",
        object_text=described(command.object),
        action_text=command.action_text,
        target_text=target_text(command),
        primitive=command.primitive.value,
        relation=command.relation.value,
        object=thing,
        object_probability=choice.probability if choice is not None else 0.0,
        scene=tuple(d for d in context.things if (thing is None or d.id != thing.id) and d.id != receiver),
        table=evidence.scene.table,
        object_candidates=choice.candidates if choice is not None else candidates,
        object_frame_s=evidence.object_frame_s,
        target_frame_s=evidence.target_frame_s,
        backends=tuple(
            x for x in (f"language={command.backend}", f"detection={evidence.scene.backend}") if x[-1] != "="
        ),
    )
    outline = context.surface.polygon
    if thing is not None and isinstance(error, UnsettledError):
        grounded = replace(grounded, target_candidates=error.candidates)
    decision = Decision(
        grounded,
        object_ray=rays[0],
        target_ray=rays[1],
        outline=np.asarray(outline.exterior.coords)[:-1] if outline is not None else np.zeros((0, 2)),
        metric=context.surface.metric,
        counterfactuals=_counterfactuals(command, rays, thing, result, context),
    )
    return decision if result is None else _with_target(decision, result)


def _with_target(decision: Decision, result: TargetResult) -> Decision:
    grounded = replace(
        decision.grounded,
        primitive=_done_as(decision.grounded.primitive, result),
        target=result.target,
        target_probability=(result.reference or result.choice).probability,
        target_candidates=result.choice.candidates,
    )
    return replace(
        decision, grounded=grounded, target_point=result.point, cells=result.cells, reference=result.reference
    )


def _done_as(primitive: str, result: TargetResult) -> str:
    """Return what is done with the object: "put it in the corner" is no putting into a thing."""
    if primitive in (Primitive.PUT_IN.value, Primitive.PUT_ON.value, Primitive.STACK.value, Primitive.PLACE.value):
        return result.primitive.value
    return primitive


def _counterfactuals(
    command: Command,
    rays: tuple[PhraseRay, PhraseRay],
    thing: Detection | None,
    result: TargetResult | None,
    context: Context,
) -> tuple[Counterfactual, ...]:
    """Say which thing would have been likeliest from the words alone, and from the gesture alone."""
    queries = {}
    if command.object is not None and context.things:
        queries["object"] = Query(command.object, rays[0])
    if command.target is not None and thing is not None and result is not None and result.target.detection is not None:
        queries["target"] = Query(command.target, rays[1], frozenset((thing.id,)), command.primitive)
    found = []
    for part, query in queries.items():
        nothing = PhraseRay(query.ray.role, query.ray.start_s, query.ray.end_s)
        for without, changed in (("gesture", replace(query, ray=nothing)), ("words", replace(query, use_words=False))):
            best = weigh(changed, context)[0]
            found.append(Counterfactual(without, part, best.id, best.probability))
    return tuple(found)
