# SPDX-License-Identifier: Apache-2.0
"""Which thing a reference means: all terms of its posterior in one place.

Factors of a candidate (natural logs): `words` (the detector's probability of the phrase), `ray` (gesture, see
pointing.ray_log), `relation` (to its anchor, "the cup next to the bottle"), `compared` ("the left one", "the biggest"),
`rival` (another noun of the command fits the thing better), `discourse` ("it", "the other one"), `plausible` (a
receiving thing should be able to receive), `reach`. "none" stands for everything that was not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from uncom_language.types import Primitive, Reference, Relation, Span
from uncom_perception.types import Detection

from uncom_reasoner.context import Context
from uncom_reasoner.exceptions import NotSupportedError
from uncom_reasoner.phrases import (
    CONTAINER,
    OBJECTS,
    comparisons,
    is_bare,
    is_place_word,
    is_pronoun,
    is_table,
    references_of,
)
from uncom_reasoner.pointing import PointingError, pointing_error, ray_log
from uncom_reasoner.posterior import NONE, label_of, normalised
from uncom_reasoner.rays import phrase_ray, phrase_span
from uncom_reasoner.relations import relation_log
from uncom_reasoner.surface import centre_of
from uncom_reasoner.types import Candidate, Factor, FloatArray, PhraseRay

_SPATIAL = frozenset(relation.value for relation in Relation)  # comparisons hang on anchors as well

LEAST = 1e-6
KIND_SHARE = 0.2  # things whose score is this share of the best are of the kind that is compared
MOST_RIVAL = -3.0
RANK_LOG = -2.5  # for each place in the order of a comparison


@dataclass(frozen=True)
class Query:
    """One reference to be found: its gesture, what it cannot be, and what is to be done with it."""

    reference: Reference
    ray: PhraseRay
    excluded: frozenset[str] = frozenset()
    receives: Primitive | None = None  # set for a target: what the thing must take
    use_words: bool = True


def weigh(query: Query, context: Context) -> tuple[Candidate, ...]:
    """Return all things, and "none", with every factor, likeliest first."""
    scores, none = _word_scores(query, context)
    terms: dict[str, dict[str, float]] = {d.id: {} for d in context.things if d.id not in query.excluded}
    for detection, score in zip(context.things, scores, strict=True):
        if detection.id in terms:
            terms[detection.id]["words"] = context.weights.phrase * float(np.log(max(score, LEAST)))
    if query.use_words:
        _add_rival(query, context, terms, scores)
    _add_ray(query, context, terms)
    _add_anchor(query, context, terms)
    _add_comparison(query, context, terms, scores)
    _add_discourse(query, context, terms)
    _add_plausible(query, context, terms)
    _add_reach(query, context, terms)
    candidates = [
        Candidate(d.id, label_of(d), tuple(Factor(k, v) for k, v in terms[d.id].items()), 0.0, d.box)
        for d in context.things
        if d.id in terms
    ]
    unseen = (Factor("words", context.weights.phrase * float(np.log(max(none, LEAST)))),)
    return normalised([*candidates, Candidate(NONE, NONE, unseen, 0.0)])


def _word_scores(query: Query, context: Context) -> tuple[tuple[float, ...], float]:
    if query.use_words:
        return context.scores(context.phrase(query.reference))
    return context.scores(OBJECTS)


def gesture(role: str, reference: Reference, context: Context, others: Sequence[Span] = ()) -> PhraseRay:
    """Return the gesture of a reference: the hands' dwells around its words.

    A gesture that goes with a pointing word of the locating phrase ("the cup next to this bottle") is not its own.
    """
    span = phrase_span(reference)
    inner = reference.anchor
    if inner is not None and inner.deictic and not reference.deictic:
        return PhraseRay(role, span.start_s, span.end_s)
    return phrase_ray(role, span, context.dwells, context.weights, others)


def anchor_gesture(anchor: Reference, context: Context) -> PhraseRay:
    """Return the gesture of a thing that only locates another: one only if it has a pointing word."""
    if anchor.deictic:
        return gesture("anchor", anchor, context)
    return PhraseRay("anchor", anchor.span.start_s, anchor.span.end_s)


def errors_of(ray: PhraseRay, detection: Detection, context: Context) -> dict[int, PointingError]:
    """Return the pointing error of a thing for each dwell of a gesture."""
    return {i: pointing_error(dwell, detection, context.weights) for i, (dwell, _) in enumerate(ray.dwells)}


def nearest_z(ray: PhraseRay, detection: Detection, context: Context) -> float:
    """Return the error [standard deviations] of a thing from the gesture's main dwell; infinite without one."""
    if not ray.present:
        return float("inf")
    main = max(range(len(ray.dwells)), key=lambda i: ray.dwells[i][1])
    return errors_of(ray, detection, context)[main].z


def _add_ray(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    if not query.ray.present:
        return
    w = context.weights
    bare, deictic = is_bare(query.reference), bool(query.reference.deictic)
    stray = w.stray_deictic if deictic or bare else w.stray_named
    logs = {i: w.ray * ray_log(query.ray, errors_of(query.ray, context.thing(i), context), stray) for i in terms}
    # A finger on a lemon does not make a pear of it: for a named thing the gesture mostly chooses among what was seen.
    kept = 1.0 if bare else w.boost_deictic if deictic else w.boost_named
    least = (1.0 - kept) * max(max(logs.values(), default=0.0), 0.0)
    for thing_id, factors in terms.items():
        factors["ray"] = logs[thing_id] - least


def _add_anchor(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    reference = query.reference
    if reference.anchor is None or not reference.anchor_relation:
        return
    if reference.anchor_relation not in _SPATIAL:
        words = reference.anchor_relation.replace("_", " ")
        raise NotSupportedError(f"I cannot compare things yet ({words} as the {reference.anchor.text}).")
    relation = Relation(reference.anchor_relation)
    anchors = weigh(Query(reference.anchor, anchor_gesture(reference.anchor, context)), context)
    for thing_id, factors in terms.items():
        logs = []
        for anchor in anchors:
            if anchor.id in (NONE, thing_id) or context.footprints[anchor.id].is_empty:
                continue
            fit = relation_log(relation, context.footprints[thing_id], context.footprints[anchor.id], context.surface)
            logs.append(np.log(max(anchor.probability, LEAST)) + fit)
        if logs and not context.footprints[thing_id].is_empty:
            factors["relation"] = context.weights.relation * float(np.logaddexp.reduce(logs))


def _add_rival(query: Query, context: Context, terms: dict[str, dict[str, float]], scores: Sequence[float]) -> None:
    """Doubt things that another noun of the command fits better: who says "banana" and "box" means two kinds."""
    mine = query.reference
    others = {
        context.phrase(r)
        for r in references_of(context.evidence.command)
        if r is not mine and not is_bare(r) and not is_table(r) and not is_place_word(r) and r.head != mine.head
    }
    if is_bare(mine) or not others:
        return
    rivals = np.max([context.scores(phrase)[0] for phrase in sorted(others)], axis=0)
    logs = {
        d.id: max(float(np.log(max(score, LEAST) / max(score + rival, LEAST))), MOST_RIVAL)
        for d, score, rival in zip(context.things, scores, rivals, strict=True)
        if d.id in terms
    }
    best = max(logs.values(), default=0.0)
    for thing_id, value in logs.items():
        terms[thing_id]["rival"] = context.weights.rival * (value - best)


def _add_comparison(
    query: Query, context: Context, terms: dict[str, dict[str, float]], scores: Collection[float]
) -> None:
    ways = comparisons(query.reference)
    if not ways:
        return
    seen = [(d, s) for d, s in zip(context.things, scores, strict=True) if d.id in terms]
    best = max((s for _, s in seen), default=0.0)
    kind = [d for d, s in seen if s >= KIND_SHARE * best]
    for way in ways:
        values = np.array([_compared(way, d, context) for d in kind])
        if way == "middle":
            values = -np.abs(values - np.median(values))
        for rank, index in enumerate(np.argsort(-values, kind="stable")):
            factors = terms[kind[int(index)].id]
            factors["compared"] = factors.get("compared", 0.0) + context.weights.position * RANK_LOG * rank


def _compared(way: str, detection: Detection, context: Context) -> float:
    """Return the quantity of which the wanted thing has most."""
    shape = context.footprints[detection.id]
    centre = centre_of(shape) if not shape.is_empty else np.zeros(2)
    surface = context.surface
    side = {
        "left": -surface.right,
        "right": surface.right,
        "near": -surface.far,
        "far": surface.far,
        "middle": surface.right,
    }
    if way in side:
        return float(centre @ side[way])
    geometry = detection.geometry
    box = detection.box
    height = float(geometry.size[2]) if geometry is not None else box.y_max - box.y_min
    length = float(geometry.size.max()) if geometry is not None else max(box.x_max - box.x_min, box.y_max - box.y_min)
    volume = float(np.prod(geometry.size)) if geometry is not None else float(detection.mask.sum())
    return {"large": volume, "small": -volume, "tall": height, "low": -height, "long": length}[way]


def _add_discourse(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    memory, reference = context.memory, query.reference
    if is_pronoun(reference) and memory.places:
        for thing_id, factors in terms.items():
            factors["discourse"] = context.weights.discourse * _familiar(context.thing(thing_id), memory.places, -6.0)
    elif reference.other and not query.excluded:
        places = list(memory.places)
        if memory.target is not None and memory.target.geometry is not None:
            places.append(memory.target.geometry.centroid)
        for thing_id, factors in terms.items():
            near = np.exp(_familiar(context.thing(thing_id), tuple(places), -6.0)) if places else 0.0
            factors["discourse"] = context.weights.discourse * -5.0 * float(near)


def _familiar(detection: Detection, places: tuple[FloatArray, ...], least: float) -> float:
    """Return a log that is 0 where a known thing was or went, and `least` elsewhere."""
    if detection.geometry is None:
        return least
    offsets = [np.linalg.norm(detection.geometry.centroid[:2] - place[:2]) for place in places]
    return max(-0.5 * float(min(offsets) / 0.04) ** 2, least)


def _add_plausible(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    """Prefer containers for a receiving thing that is not named (paper, section III-H)."""
    if query.receives is None or not is_bare(query.reference):
        return
    share = 0.5 if query.receives in (Primitive.PUT_ON, Primitive.STACK) else 1.0
    scores, _ = context.scores(CONTAINER)
    best = max(max(scores, default=0.0), 0.05)
    for detection, score in zip(context.things, scores, strict=True):
        if detection.id in terms:
            fit = float(np.log(max(score / best, 0.03)))
            terms[detection.id]["plausible"] = context.weights.plausible * share * fit


def _add_reach(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    """Slightly doubt things that no arm reaches from here."""
    if not context.surface.reach or query.receives is not None:
        return
    for thing_id, factors in terms.items():
        shape = context.footprints[thing_id]
        if not shape.is_empty:
            centre = centre_of(shape)
            distance = min(float(np.linalg.norm(centre - np.array(s))) for s in context.surface.reach)
            excess = max(distance - context.surface.reach_max, 0.0)
            factors["reach"] = max(-0.5 * (excess / 0.15) ** 2, -1.0)
