# SPDX-License-Identifier: Apache-2.0
"""Which stage of a missed take went wrong first: heard, parsed, hand, detection or choice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from uncom_common.primitive import Primitive
from uncom_language.types import Command, Reference, Relation
from uncom_reasoner.detector_phrases import GENERIC_NOUNS, detector_phrase, is_bare, is_place_word
from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.types import Evidence

from uncom_sim.bench_understanding.judging.options import FAILURE_STAGES, FailureStageOptions
from uncom_sim.bench_understanding.judging.verdict import Verdict, matched_object_id
from uncom_sim.bench_understanding.takes.recording import TakeRecording, TruePointing
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.world.intended_meaning import named_objects

STAGES = ("heard", "parsed", "hand", "detection", "choice")
_FAMILIES = {"fruit": {"banana", "apple", "lemon", "orange", "pear"}}
_ALIAS = {"pan": "frying pan", "cereal": "cereal box"}


def first_wrong_stage(
    plan: TakePlan,
    recording: TakeRecording,
    command: Command | None,
    true_command: Command | None,
    evidence: Evidence | None,
    *,
    options: FailureStageOptions = FAILURE_STAGES,
) -> tuple[str, str]:
    """Return the stage and what was wrong in it; command is what was made of what was heard.

    true_command is what the same parser makes of the true words: what it gets wrong, it gets wrong on its own.
    """
    if true_command is None or (fault := _parse_fault(plan, true_command)):
        return "parsed", fault if true_command is not None else "no command was found in the true words"
    if command is None or _command_meaning(command) != _command_meaning(true_command):
        return "heard", "other words were heard than said"
    if evidence is None:
        return "detection", "nothing was looked at"
    for pointing in recording.truth.pointing:
        fault = _hand_fault(pointing, evidence.rays, options=options)
        if fault:
            return "hand", fault
    fault = _detection_fault(plan, recording, evidence)
    return ("detection", fault) if fault else ("choice", "all that was needed was known")


def _parse_fault(plan: TakePlan, command: Command) -> str:
    meaning = plan.meaning
    if command.primitive not in plan.actions:
        return f"the action was taken for {command.primitive.value}"
    if command.object is None or not _may_refer_to(command.object, plan, meaning.object):
        return "the object's words were taken for others"
    relation = command.relation.value
    allowed = {
        "area": {r.value for r in (Relation.HERE, Relation.THERE, Relation.ON, Relation.NONE, Relation.IN)},
        "next_to": {"next_to", "near"},
        "in": {"in", "on", "none"} if Primitive.POUR in plan.actions else {"in"},
    }.get(meaning.relation, {meaning.relation})
    if relation not in allowed:
        return f"the relation was taken for {relation}"
    if command.target is None:
        return "no target was found in the words"
    if meaning.target is None:
        return "" if is_place_word(command.target) else "the place was taken for a thing"
    return "" if _may_refer_to(command.target, plan, meaning.target) else "the target's words were taken for others"


def _may_refer_to(reference: Reference, plan: TakePlan, name: str) -> bool:
    """Whether words can name an object: by its kind, its family, or as "this thing"."""
    if is_bare(reference) or reference.head in GENERIC_NOUNS:
        return True
    head = _ALIAS.get(reference.head, reference.head)
    if plan.scene.object(name).kind in _FAMILIES.get(head, ()):
        return True
    return name in named_objects(plan.scene, head.split())


def same_request(a: Command | None, b: Command | None) -> bool:
    """Whether two commands ask for the same; whether they say "this" or "the" does not matter."""
    if a is None or b is None:
        return a is b
    return (a.primitive, a.relation, _noun_phrase(a.object), _noun_phrase(a.target)) == (
        b.primitive,
        b.relation,
        _noun_phrase(b.object),
        _noun_phrase(b.target),
    )


def _command_meaning(command: Command) -> tuple[object, ...]:
    """Return what matters of a command, without times and texts."""
    return (command.primitive, command.relation, _reference_meaning(command.object), _reference_meaning(command.target))


def _reference_meaning(reference: Reference | None) -> tuple[object, ...]:
    return () if reference is None else (*_noun_phrase(reference), bool(reference.deictic), reference.other)


def _noun_phrase(reference: Reference | None) -> tuple[object, ...]:
    if reference is None:
        return ()
    if is_place_word(reference):
        return ("here",)
    return ("thing" if is_bare(reference) else reference.head, tuple(sorted(reference.modifiers)))


def _hand_fault(
    pointing: TruePointing, rays: Sequence[RayObservation], *, options: FailureStageOptions = FAILURE_STAGES
) -> str:
    """Compare the rays seen while the finger was on a place with where that is."""
    place = np.asarray(pointing.place)
    near = [r for r in rays if pointing.start_s - options.early_s <= r.stamp_s <= pointing.end_s + options.late_s]
    if not near:
        return f"no pointing hand was seen while the {pointing.role} was pointed at"
    errors = [_ray_error(ray, place) for ray in near if ray.space is not None]
    if not errors:
        return f"the hand that pointed at the {pointing.role} was not seen in depth"
    angle, distance = (float(np.median([e[i] for e in errors])) for i in (0, 1))
    if angle > options.off_rad and distance > options.off_m:
        degrees = np.degrees(angle)
        return f"the finger that pointed at the {pointing.role} was seen {degrees:.0f} deg and {distance:.2f} m off"
    return ""


def _ray_error(ray: RayObservation, place: np.ndarray) -> tuple[float, float]:
    """Return the angle [rad] and the distance [m] by which a ray misses a place."""
    if ray.space is None:
        return np.pi, np.inf
    to_place = place - ray.space.tip
    along = float(to_place @ ray.space.direction)
    distance = float(np.linalg.norm(to_place - max(along, 0.0) * ray.space.direction))
    length = float(np.linalg.norm(to_place))
    return float(np.arccos(np.clip(along / max(length, 1e-9), -1.0, 1.0))), distance


def _detection_fault(plan: TakePlan, recording: TakeRecording, evidence: Evidence) -> str:
    """Whether the meant objects were found as one object each, and named by their words."""
    states, command, scene = recording.truth.states, evidence.command, evidence.scene
    if scene.table is None:
        return "the table was not found"
    found = [matched_object_id(d, states) for d in scene.detections]
    for role, reference in (("object", command.object), ("target", command.target)):
        name = getattr(plan.meaning, role)
        if name is None or reference is None:
            continue
        number = found.count(name)
        if number != 1:
            return f"the {role} was {'not found' if number == 0 else f'taken for {number} things'}"
        phrase = detector_phrase(reference)
        if phrase not in evidence.phrases:
            continue
        scores = [d.phrase_scores[evidence.phrases.index(phrase)] for d in scene.detections]
        own = scores[found.index(name)]
        if own < 0.3 * max(scores):
            other = found[int(np.argmax(scores))]
            return f"{phrase!r} fits {other} better ({max(scores):.2f}) than the {role} that is meant ({own:.2f})"
    return ""


def explain_miss(verdict: Verdict, stage: str, detail: str) -> str:
    """Put verdict and stage into one line."""
    return f"{verdict.why or verdict.reason} ({stage}: {detail})"
