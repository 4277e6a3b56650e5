# SPDX-License-Identifier: Apache-2.0
"""Which thing a reference means: all terms of its posterior in one place.

Factors of a candidate (natural logs): `words` (the detector's probability of the phrase), `ray` (gesture, see
pointing.ray_log), `relation` (to its anchor, "the cup next to the bottle"), `compared` ("the left one", "the biggest",
"the second from the left"), `excluded` ("not the red one"), `likeness` ("the same colour as this"), `rival` (another
noun of the command fits the thing better), `discourse` ("it", "the other one"), `plausible` (a receiving thing should
be able to receive), `reach`, `answer` (what the person said when asked), `squarely` (which container "here" points
into). "none" stands for everything not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_language.types import Reference, Relation, Span
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import (
    CONTAINER,
    OBJECTS,
    is_bare,
    is_place_word,
    is_pronoun,
    is_table,
    references_of,
)
from uncom_reasoner.pointing.pointing_likelihood import PointingError, pointing_error, ray_log
from uncom_reasoner.pointing.ray_fusion import phrase_ray, phrase_span
from uncom_reasoner.posterior.comparatives import RANK_LOG, excluded_logs, likeness_logs, order_logs
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.posterior import NONE, label_of, normalised
from uncom_reasoner.support.spatial_relations import relation_log
from uncom_reasoner.support.support_plane import centre_of
from uncom_reasoner.types import Candidate, Factor, FloatArray, PhraseRay

LEAST = 1e-6
AND = "and"  # joins B to A in "between A and B"
MOST_RIVAL = -3.0
ANSWER_LOG = -40.0  # an answer settles it


@dataclass(frozen=True)
class Query:
    """One reference to be found: its gesture, what it cannot be, and what is to be done with it."""

    reference: Reference
    ray: PhraseRay
    excluded: frozenset[str] = frozenset()
    receives: Primitive | None = None  # set for a target: what the thing must take
    use_words: bool = True
    among: frozenset[str] | None = None  # only these can be it, for a reason of the caller's ("squarely pointed at")


def weigh(query: Query, context: Context) -> tuple[Candidate, ...]:
    """Return all things, and "none", with every factor, likeliest first."""
    scores, none = _word_scores(query, context)
    terms: dict[str, dict[str, float]] = {d.id: {} for d in context.things if d.id not in query.excluded}
    for detection, score in zip(context.things, scores, strict=True):
        if detection.id in terms:
            terms[detection.id]["words"] = context.weights.phrase * float(np.log(max(score, LEAST)))
    _add_ray(query, context, terms)
    if query.use_words:
        _add_rival(query, context, terms, scores)
        _add_anchor(query, context, terms)
        _add_comparison(query, context, terms, scores)
        _add_discourse(query, context, terms)
    _add_plausible(query, context, terms)
    _add_reach(query, context, terms)
    answered = _add_answer(query, context, terms)
    if query.among is not None:
        for thing_id, factors in terms.items():
            factors["squarely"] = 0.0 if thing_id in query.among else ANSWER_LOG
    candidates = [
        Candidate(d.id, label_of(d), tuple(Factor(k, v) for k, v in terms[d.id].items()), 0.0, d.box)
        for d in context.things
        if d.id in terms
    ]
    unseen = [Factor("words", context.weights.phrase * float(np.log(max(none, LEAST))))]
    unseen.append(Factor("discount", -context.weights.none_discount))
    if answered:
        unseen.append(Factor("answer", ANSWER_LOG))
    if query.among is not None:
        unseen.append(Factor("squarely", ANSWER_LOG))
    return normalised([*candidates, Candidate(NONE, NONE, tuple(unseen), 0.0)])


def _word_scores(query: Query, context: Context) -> tuple[tuple[float, ...], float]:
    if query.use_words:
        return context.scores(context.phrase(query.reference))
    return context.scores(OBJECTS)


def gesture(role: str, reference: Reference, context: Context, others: Sequence[Span] = ()) -> PhraseRay:
    """Return the gesture of a reference: the hands' dwells around its words.

    A gesture that goes with a pointing word of the locating phrase ("the cup next to this bottle") is not its own.
    """
    span = phrase_span(reference)
    inner = [r for r in (reference.anchor, reference.compared_to) if r is not None and r.deictic]
    if inner and not reference.deictic:
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
    # A gesture of which little was seen is less likely to be about these words.
    sure = min(query.ray.weight / (2.0 * w.min_gesture_weight), 1.0)
    stray = 1.0 - (1.0 - stray) * sure
    logs = {i: w.ray * ray_log(query.ray, errors_of(query.ray, context.thing(i), context), stray) for i in terms}
    # A finger on a lemon does not make a pear of it: for a named thing the gesture mostly chooses among what was seen.
    kept = 1.0 if bare else w.boost_deictic if deictic else w.boost_named
    least = (1.0 - kept) * max(max(logs.values(), default=0.0), 0.0)
    for thing_id, factors in terms.items():
        factors["ray"] = logs[thing_id] - least


def _add_anchor(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> None:
    """Weigh things by where they are with respect to their anchor, whichever thing that is."""
    reference = query.reference
    if reference.anchor is None or reference.anchor_relation in ("", AND):
        return
    relation = Relation(reference.anchor_relation)
    shapes = context.footprints
    anchors = _anchors(reference.anchor, context)
    seconds: list[tuple[float, Polygon | None]] = [(0.0, None)]
    if relation is Relation.BETWEEN and reference.anchor.anchor is not None:
        seconds = [(log, shapes[other]) for log, other in _anchors(reference.anchor.anchor, context)]
    for thing_id, factors in terms.items():
        if shapes[thing_id].is_empty:
            continue
        logs = [
            log + more + relation_log(relation, shapes[thing_id], shapes[anchor], context.surface, second)
            for log, anchor in anchors
            if anchor != thing_id
            for more, second in seconds
            if second is None or second not in (shapes[thing_id], shapes[anchor])
        ]
        if logs:
            factors["relation"] = context.weights.relation * float(np.logaddexp.reduce(logs))


def _anchors(reference: Reference, context: Context) -> list[tuple[float, str]]:
    """Return the log probabilities and ids of the things that may be an anchor."""
    found = weigh(Query(reference, anchor_gesture(reference, context)), context)
    seen = [c for c in found if c.id != NONE and not context.footprints[c.id].is_empty]
    return [(float(np.log(max(c.probability, LEAST))), c.id) for c in seen]


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
    """Superlatives, sides, ordinals; what is excluded; what is compared with another thing."""
    reference = query.reference
    mine = {d.id: s for d, s in zip(context.things, scores, strict=True) if d.id in terms}
    found = {"compared": order_logs(reference, mine, context), "excluded": excluded_logs(reference, context)}
    if reference.comparison and reference.compared_to is not None:
        other = reference.compared_to
        compared = weigh(Query(other, anchor_gesture(other, context)), context)
        found["likeness"] = likeness_logs(reference.comparison, compared, mine, context)
    for name, logs in found.items():
        least = min(logs.values(), default=0.0)  # things of another kind are in no order
        for thing_id, factors in terms.items() if logs else ():
            factors[name] = context.weights.position * logs.get(thing_id, min(least, 4.0 * RANK_LOG))


def _add_answer(query: Query, context: Context, terms: dict[str, dict[str, float]]) -> bool:
    """Take in what the person answered about this part; returns whether it must be one of the things."""
    among = context.evidence.given.among.get(query.ray.role)
    excluded = context.evidence.given.excluded.get(query.ray.role, frozenset())
    for thing_id, factors in terms.items() if among is not None or excluded else ():
        no = thing_id in excluded or (among is not None and thing_id not in among)
        factors["answer"] = ANSWER_LOG if no else 0.0
    return among is not None


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
