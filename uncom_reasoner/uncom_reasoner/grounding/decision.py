# SPDX-License-Identifier: Apache-2.0
"""Decisions as values: what was found, and what would have been found without the gesture or without the words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_common.transforms import FloatArray
from uncom_language.types import Command
from uncom_perception.types import Detection

from uncom_reasoner.exceptions import AmbiguousError, CannotGroundError, NotSupportedError, UnsettledError
from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.grounding.phrasing import caption_reference, caption_target
from uncom_reasoner.grounding.place_resolution import TargetResult
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.object_likelihood import Query, weigh_candidates
from uncom_reasoner.types import Candidate, Choice, Counterfactual, Decision, Doubt, GroundedCommand, Status


def failed_command(command: Command, reason: str) -> GroundedCommand:
    """Return a grounded command that failed before anything was looked at."""
    return GroundedCommand(
        stamp_s=0.0,
        frame_id="",
        utterance_id=command.utterance_id,
        index=command.index,
        status=Status.FAILED,
        reason=reason,
        object_text=caption_reference(command.object),
        action_text=command.action_text,
        target_text=caption_target(command),
        primitive=command.primitive,
        relation=command.relation.value,
    )


def build_decision(
    command: Command,
    context: Context,
    rays: tuple[PhraseRay, PhraseRay],
    error: CannotGroundError | None,
    choice: Choice | None = None,
    detection: Detection | None = None,
    result: TargetResult | None = None,
    candidates: tuple[Candidate, ...] = (),
) -> Decision:
    """Build a decision from the object's choice and the target's result, or from the error that ended it.

    Args:
        command: as it was said.
        context: of the decision.
        rays: gestures of object and target.
        error: why it failed or is ambiguous, or None.
        choice: of the object, if it was settled.
        detection: the object.
        result: the target.
        candidates: what was weighed for an object that was not settled.
    """
    grounded = replace(
        failed_command(command, str(error) if error is not None else ""),
        stamp_s=context.evidence.scene.stamp_s,
        frame_id=context.evidence.scene.frame_id,
        status=_find_status(error),
        object=detection,
        object_probability=choice.probability if choice is not None else 0.0,
        scene=_list_others(context, detection, result),
        table=context.evidence.scene.table,
        object_candidates=choice.candidates if choice is not None else candidates,
        object_frame_s=context.evidence.object_frame_s,
        target_frame_s=context.evidence.target_frame_s,
        backends=_list_backends(command, context),
    )
    if detection is not None and isinstance(error, UnsettledError):
        grounded = replace(grounded, target_candidates=error.candidates)
    decision = Decision(
        grounded,
        notes=(*context.evidence.notes, *command.notes),
        rules={} if choice is None else {"object": choice.rule},
        doubt=_find_doubt(error, detection),
        object_ray=rays[0],
        target_ray=rays[1],
        outline=_list_corners(context.surface.polygon),
        metric=context.surface.metric,
        counterfactuals=()
        if isinstance(error, NotSupportedError)  # what cannot be weighed cannot be weighed otherwise
        else _find_counterfactuals(command, rays, detection, result, context),
    )
    return decision if result is None else _add_target(decision, result)


def _find_status(error: CannotGroundError | None) -> Status:
    if error is None:
        return Status.GROUNDED
    return Status.AMBIGUOUS if isinstance(error, AmbiguousError) else Status.FAILED


def _find_doubt(error: CannotGroundError | None, detection: Detection | None) -> Doubt | None:
    """Return what is ambiguous: the part that the error names, else the object, or the target where that is known."""
    if not isinstance(error, AmbiguousError):
        return None
    return Doubt(error.part or ("object" if detection is None else "target"), error.choices)


def _list_corners(outline: Polygon | None) -> FloatArray:
    return np.asarray(outline.exterior.coords)[:-1] if outline is not None else np.zeros((0, 2))


def _list_others(context: Context, moved: Detection | None, result: TargetResult | None) -> tuple[Detection, ...]:
    """Return what was seen beside the object and its receiver."""
    receiver = result.target.detection if result is not None else None
    used = {detection.id for detection in (moved, receiver) if detection is not None}
    return tuple(d for d in context.detections if d.id not in used)


def _list_backends(command: Command, context: Context) -> tuple[str, ...]:
    names = {"language": command.backend, "detection": context.evidence.scene.backend}
    return tuple(f"{stage}={name}" for stage, name in names.items() if name)


def _add_target(decision: Decision, result: TargetResult) -> Decision:
    grounded = replace(
        decision.grounded,
        primitive=_executed_primitive(decision.grounded.primitive, result),
        target=result.target,
        target_probability=(result.reference or result.choice).probability,
        target_candidates=result.choice.candidates,
    )
    return replace(
        decision,
        grounded=grounded,
        target_point=result.point,
        cells=result.cells,
        reference=result.reference,
        second=result.second,
        rules={**decision.rules, "target": result.choice.rule}
        | {name: c.rule for name, c in (("reference", result.reference), ("second", result.second)) if c is not None},
        place=result.place,
    )


def _executed_primitive(primitive: Primitive, result: TargetResult) -> Primitive:
    """Return what is done with the object: "put it in the corner" is no putting into an object."""
    if primitive in (Primitive.PUT_IN, Primitive.PUT_ON, Primitive.STACK, Primitive.PLACE):
        return result.primitive
    return primitive


def _find_counterfactuals(
    command: Command,
    rays: tuple[PhraseRay, PhraseRay],
    detection: Detection | None,
    result: TargetResult | None,
    context: Context,
) -> tuple[Counterfactual, ...]:
    """Say which object would have been likeliest from the words alone, and from the gesture alone."""
    queries = {}
    if command.object is not None and context.detections:
        queries["object"] = Query(command.object, rays[0])
    if (
        command.target is not None
        and detection is not None
        and result is not None
        and result.target.detection is not None
    ):
        queries["target"] = Query(command.target, rays[1], frozenset((detection.id,)), command.primitive)
    found = []
    for part, query in queries.items():
        no_gesture = PhraseRay(query.ray.role, query.ray.start_s, query.ray.end_s)
        for without, changed in (
            ("gesture", replace(query, ray=no_gesture)),
            ("words", replace(query, use_words=False)),
        ):
            best = weigh_candidates(changed, context)[0]
            found.append(Counterfactual(without, part, best.id, best.probability))
    return tuple(found)
