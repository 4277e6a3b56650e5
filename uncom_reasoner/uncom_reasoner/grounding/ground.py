# SPDX-License-Identifier: Apache-2.0
"""From a command, the hands and the scene to a grounded command: the facade of this package."""

from __future__ import annotations

from dataclasses import replace

from shapely import transform
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_language.types import Reference, Relation

from uncom_reasoner.config import PlacingConfig
from uncom_reasoner.detector_phrases import depends_on_perspective, is_unspecific, replace_parts
from uncom_reasoner.exceptions import CannotGroundError
from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.grounding.decision import build_decision
from uncom_reasoner.grounding.ground_group import select_members
from uncom_reasoner.grounding.ground_single import find_gestures, ground_once
from uncom_reasoner.grounding.perspective import decide_perspective
from uncom_reasoner.grounding.phrasing import pluralize
from uncom_reasoner.posterior.context import Context, build_context
from uncom_reasoner.posterior.discourse_memory import DiscourseMemory
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.support.support_plane import find_centre
from uncom_reasoner.types import Candidate, Decision, Evidence, Status, TargetKind
from uncom_reasoner.weights import Weights, load_weights


def ground(
    evidence: Evidence,
    weights: Weights | None = None,
    placing: PlacingConfig | None = None,
    memory: DiscourseMemory | None = None,
) -> Decision:
    """Ground a command (Act.COMMAND); of a group the first part. See `ground_parts`."""
    return ground_parts(evidence, weights, placing, memory)[0]


def ground_parts(
    evidence: Evidence,
    weights: Weights | None = None,
    placing: PlacingConfig | None = None,
    memory: DiscourseMemory | None = None,
) -> tuple[Decision, ...]:
    """Ground a command (Act.COMMAND): one decision, or one for each object of a group, in the order of moving them.

    What a person says or shows wrongly is told by status and reason.

    Args:
        evidence: command, scene (detected with `detector_phrases.phrases_for(command)`), camera and rays
            (`ray_fusion.observe_rays`).
        weights: of the posterior; None: the shipped ones.
        placing: how places are chosen; None: the defaults.
        memory: of what was spoken of before.
    """
    weights, placing, memory = weights or load_weights(), placing or PlacingConfig(), memory or DiscourseMemory()
    command = replace_parts(evidence.command)
    evidence = replace(evidence, command=command)
    if command.object is not None and command.object.quantity != 1:
        return _ground_group(evidence, command.object, weights, placing, memory)
    return (_ground_object(evidence, weights, placing, memory),)


def _ground_object(evidence: Evidence, weights: Weights, placing: PlacingConfig, memory: DiscourseMemory) -> Decision:
    side = evidence.given.perspective
    if side:
        return replace(ground_once(evidence, weights, replace(placing, perspective=side), memory), perspective=side)
    if not depends_on_perspective(evidence.command):
        return ground_once(evidence, weights, placing, memory)
    return decide_perspective(
        lambda side_placing: ground_once(evidence, weights, side_placing, memory), placing, weights
    )


def _ground_group(
    evidence: Evidence, reference: Reference, weights: Weights, placing: PlacingConfig, memory: DiscourseMemory
) -> tuple[Decision, ...]:
    """Choose the objects of a reference, then a place for each with the earlier ones where they will be."""
    command, given = evidence.command, evidence.given
    context = build_context(evidence, weights, placing, memory)
    rays = find_gestures(command, context)
    candidates: tuple[Candidate, ...] = ()
    try:
        candidates = _weigh_group(reference, rays[0], context)
        chosen, base = _choose_members(reference, candidates, rays[0], context)
    except CannotGroundError as error:
        return (build_decision(command, context, rays, error, candidates=candidates),)
    single = replace(command, object=replace(reference, quantity=1))
    if base:
        single = replace(single, target=single.object, relation=Relation.ON)
        given = replace(given, among={**given.among, "target": frozenset((base,))})
    decisions: list[Decision] = []
    for part, name in enumerate(chosen):
        others = given.excluded.get("target", frozenset()) | frozenset(chosen) - {name}
        settled = replace(
            given,
            among={**given.among, "object": frozenset((name,))},
            excluded={**given.excluded, "target": others},
        )
        decision = _ground_object(replace(evidence, command=single, given=settled), weights, placing, memory)
        grounded = replace(decision.grounded, part=part, parts=len(chosen))
        decisions.append(replace(decision, grounded=grounded, group=candidates))
        if grounded.status is not Status.GROUNDED:
            return (decisions[-1],)  # a group is carried out as a whole or not at all
        given = replace(given, moved={**given.moved, name: _moved_outline(decision, context.footprints[name])})
    return tuple(decisions)


def _weigh_group(reference: Reference, ray: PhraseRay, context: Context) -> tuple[Candidate, ...]:
    if not context.detections:
        raise CannotGroundError("I do not see anything on the table.")
    return weigh_candidates(Query(reference, ray), context)


def _choose_members(
    reference: Reference, candidates: tuple[Candidate, ...], ray: PhraseRay, context: Context
) -> tuple[list[str], str]:
    """Return the ids in the order of moving them, and the one that the others are stacked on ("" without)."""
    command, given = context.evidence.command, context.evidence.given
    if is_unspecific(reference) and not ray.present and "object" not in given.among:
        raise CannotGroundError("I did not see which things you pointed at.")
    found = [c.id for c in select_members(candidates, reference, command, context.weights, pointed=ray.present)]
    # Largest first: what is wide at the bottom of a pile, and the hardest to find a place for, goes before the rest.
    found.sort(key=lambda name: -context.footprints[name].area)
    if command.primitive is not Primitive.STACK or command.target is not None:
        return found, ""
    if len(found) == 1:
        raise CannotGroundError(f"I see only one of the {pluralize(reference)}: there is nothing to stack.")
    return found[1:], found[0]


def _moved_outline(decision: Decision, outline: Polygon) -> Polygon:
    """Return where an object's outline will be; empty if it will be in or on another object, or in the hand."""
    place = decision.place
    if place is None or outline.is_empty:
        return Polygon() if decision.grounded.target.kind is not TargetKind.NONE else outline
    offset = place - find_centre(outline)
    return transform(outline, lambda points: points + offset)
