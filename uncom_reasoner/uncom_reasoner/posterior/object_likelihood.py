# SPDX-License-Identifier: Apache-2.0
"""Which object a reference means: all factors of its posterior in one place.

Factors of a candidate (natural logs): `words` (the detector's probability of the phrase; a colour in it was decided by
the detector, see uncom_perception/objects/attributes), `ray` (gesture, see pointing.pointing_likelihood), `relation`
(to its anchor, "the cup next to the bottle"), `compared` ("the left one", "the biggest", "the second from the left"),
`excluded` ("not the red one"), `likeness` ("the same colour as this"), `rival` (another noun of the command fits the
object better), `discourse` ("it", "the other one"), `plausible` (a receiving object should be able to receive),
`reach`, `answer` (what the person said when asked), `squarely` (which container "here" points into). "none" stands for
everything not seen.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon
from uncom_common.primitive import Primitive
from uncom_common.transforms import FloatArray
from uncom_language.types import Reference, Relation
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import (
    CONTAINER,
    OBJECTS,
    is_bare,
    is_place_word,
    is_pronoun,
    is_table,
    iterate_references,
)
from uncom_reasoner.gesture_types import PhraseRay
from uncom_reasoner.pointing.pointing_likelihood import ray_log_likelihood
from uncom_reasoner.posterior.comparatives import comparison_logs, exclusion_logs, rank_logs
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.options import COMPARISON, OBJECT_LIKELIHOOD, ObjectLikelihoodOptions
from uncom_reasoner.posterior.phrase_gestures import find_anchor_gesture, pointing_errors
from uncom_reasoner.posterior.posterior import NONE, describe_detection, normalize
from uncom_reasoner.support.spatial_relations import relation_log_likelihood
from uncom_reasoner.support.support_plane import find_centre
from uncom_reasoner.types import Candidate, Factor

AND = "and"  # joins B to A in "between A and B"
Factors = dict[str, dict[str, float]]  # natural logs by object id and name of the factor


@dataclass(frozen=True)
class Query:
    """One reference to be found.

    Attributes:
        reference: the words.
        ray: its gesture; its role is the part of the command.
        excluded: ids of what it cannot be.
        receives: for a target: what the object must take.
        use_words: False: the gesture alone counts.
        among: only these can be it, for a reason of the caller's ("squarely pointed at"); None: all.
    """

    reference: Reference
    ray: PhraseRay
    excluded: frozenset[str] = frozenset()
    receives: Primitive | None = None
    use_words: bool = True
    among: frozenset[str] | None = None


def weigh_candidates(
    query: Query, context: Context, options: ObjectLikelihoodOptions = OBJECT_LIKELIHOOD
) -> tuple[Candidate, ...]:
    """Return all objects, and "none", with every factor, likeliest first."""
    scores, none = _score_words(query, context)
    phrase, least = context.weights.phrase, options.min_probability
    factors: Factors = {d.id: {} for d in context.detections if d.id not in query.excluded}
    for detection, score in zip(context.detections, scores, strict=True):
        if detection.id in factors:
            factors[detection.id]["words"] = phrase * float(np.log(max(score, least)))
    _add_ray(query, context, factors, options)
    if query.use_words:
        _add_rival(query, context, factors, scores, options)
        _add_anchor(query, context, factors, options)
        _add_comparison(query, context, factors, scores, options)
        _add_discourse(query, context, factors, options)
    _add_plausible(query, context, factors, options)
    _add_reach(query, context, factors, options)
    answered = _add_answer(query, context, factors, options)
    if query.among is not None:
        for name, own in factors.items():
            own["squarely"] = 0.0 if name in query.among else options.answer_log
    candidates = [
        Candidate(d.id, describe_detection(d), tuple(Factor(k, v) for k, v in factors[d.id].items()), 0.0, d.box)
        for d in context.detections
        if d.id in factors
    ]
    unseen = [Factor("words", phrase * float(np.log(max(none, least))))]
    unseen.append(Factor("discount", -context.weights.none_discount))
    if answered:
        unseen.append(Factor("answer", options.answer_log))
    if query.among is not None:
        unseen.append(Factor("squarely", options.answer_log))
    return normalize([*candidates, Candidate(NONE, NONE, tuple(unseen), 0.0)])


def _score_words(query: Query, context: Context) -> tuple[tuple[float, ...], float]:
    if query.use_words:
        return context.scores(context.phrase(query.reference))
    return context.scores(OBJECTS)


def _add_ray(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> None:
    if not query.ray.present:
        return
    w = context.weights
    bare, deictic = is_bare(query.reference), bool(query.reference.deictic)
    stray = w.stray_deictic if deictic or bare else w.stray_named
    # A gesture of which little was seen is less likely to be about these words.
    sure = min(query.ray.weight / (options.sure_gesture * w.min_gesture_weight), 1.0)
    stray = 1.0 - (1.0 - stray) * sure
    logs = {}
    for name in factors:
        errors = pointing_errors(query.ray, context.detection(name), context)
        logs[name] = w.ray * ray_log_likelihood(query.ray, errors, stray)
    # A finger on a lemon does not make a pear of it: for a named object the gesture mostly chooses among what was seen.
    kept = 1.0 if bare else w.boost_deictic if deictic else w.boost_named
    common = (1.0 - kept) * max(max(logs.values(), default=0.0), 0.0)
    for name, own in factors.items():
        own["ray"] = logs[name] - common


def _add_anchor(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> None:
    """Weigh objects by where they are with respect to their anchor, whichever object that is."""
    reference = query.reference
    if reference.anchor is None or reference.anchor_relation in ("", AND):
        return
    relation = Relation(reference.anchor_relation)
    shapes = context.footprints
    anchors = _weigh_anchors(reference.anchor, context, options)
    seconds: list[tuple[float, Polygon | None]] = [(0.0, None)]
    if relation is Relation.BETWEEN and reference.anchor.anchor is not None:
        seconds = [(log, shapes[other]) for log, other in _weigh_anchors(reference.anchor.anchor, context, options)]
    for name, own in factors.items():
        if shapes[name].is_empty:
            continue
        logs = [
            log + second_log + relation_log_likelihood(relation, shapes[name], shapes[anchor], context.surface, second)
            for log, anchor in anchors
            if anchor != name
            for second_log, second in seconds
            if second is None or second not in (shapes[name], shapes[anchor])
        ]
        if logs:
            own["relation"] = context.weights.relation * float(np.logaddexp.reduce(logs))


def _weigh_anchors(reference: Reference, context: Context, options: ObjectLikelihoodOptions) -> list[tuple[float, str]]:
    """Return the log probabilities and ids of the objects that may be an anchor."""
    candidates = weigh_candidates(Query(reference, find_anchor_gesture(reference, context)), context, options)
    seen = [c for c in candidates if c.id != NONE and not context.footprints[c.id].is_empty]
    return [(float(np.log(max(c.probability, options.min_probability))), c.id) for c in seen]


def _add_rival(
    query: Query, context: Context, factors: Factors, scores: Sequence[float], options: ObjectLikelihoodOptions
) -> None:
    """Doubt objects that another noun of the command fits better: who says "banana" and "box" means two kinds."""
    reference, least = query.reference, options.min_probability
    other_phrases = {
        context.phrase(r)
        for r in iterate_references(context.evidence.command)
        if r is not reference
        and not is_bare(r)
        and not is_table(r)
        and not is_place_word(r)
        and r.head != reference.head
    }
    if is_bare(reference) or not other_phrases:
        return
    rivals = np.max([context.scores(phrase)[0] for phrase in sorted(other_phrases)], axis=0)
    logs = {
        d.id: max(float(np.log(max(score, least) / max(score + rival, least))), options.rival_min_log)
        for d, score, rival in zip(context.detections, scores, rivals, strict=True)
        if d.id in factors
    }
    best = max(logs.values(), default=0.0)
    for name, value in logs.items():
        factors[name]["rival"] = context.weights.rival * (value - best)


def _add_comparison(
    query: Query, context: Context, factors: Factors, scores: Collection[float], options: ObjectLikelihoodOptions
) -> None:
    """Superlatives, sides, ordinals; what is excluded; what is compared with another object."""
    reference = query.reference
    own_scores = {d.id: s for d, s in zip(context.detections, scores, strict=True) if d.id in factors}
    found = {"compared": rank_logs(reference, own_scores, context), "excluded": exclusion_logs(reference, context)}
    if reference.comparison and reference.compared_to is not None:
        other = reference.compared_to
        compared = weigh_candidates(Query(other, find_anchor_gesture(other, context)), context, options)
        found["likeness"] = comparison_logs(reference.comparison, compared, own_scores, context)
    farthest = options.far_ranks * COMPARISON.rank_log
    for factor, logs in found.items():
        least = min(logs.values(), default=0.0)  # objects of another kind are in no order
        for name, own in factors.items() if logs else ():
            own[factor] = context.weights.position * logs.get(name, min(least, farthest))


def _add_answer(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> bool:
    """Rule out what the person answered about this part rules out; returns whether it must be one of the objects."""
    among = context.evidence.given.among.get(query.ray.role)
    excluded = context.evidence.given.excluded.get(query.ray.role, frozenset())
    for name, own in factors.items() if among is not None or excluded else ():
        ruled_out = name in excluded or (among is not None and name not in among)
        own["answer"] = options.answer_log if ruled_out else 0.0
    return among is not None


def _add_discourse(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> None:
    """Prefer what was spoken of for "it", and doubt it for "the other one"."""
    memory, reference, weight = context.memory, query.reference, context.weights.discourse
    if is_pronoun(reference) and memory.places:
        for name, own in factors.items():
            own["discourse"] = weight * _known_place_log(context.detection(name), memory.places, options)
    elif reference.other and not query.excluded:
        places = list(memory.places)
        if memory.target is not None and memory.target.geometry is not None:
            places.append(memory.target.geometry.centroid)
        for name, own in factors.items():
            near = np.exp(_known_place_log(context.detection(name), tuple(places), options)) if places else 0.0
            own["discourse"] = weight * options.same_again_log * float(near)


def _known_place_log(detection: Detection, places: tuple[FloatArray, ...], options: ObjectLikelihoodOptions) -> float:
    """Return a log that is 0 where a known object was or went, and `unknown_log` elsewhere."""
    if detection.geometry is None:
        return options.unknown_log
    distances = [np.linalg.norm(detection.geometry.centroid[:2] - place[:2]) for place in places]
    return max(-0.5 * float(min(distances) / options.known_place_sigma_m) ** 2, options.unknown_log)


def _add_plausible(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> None:
    """Prefer containers for a receiving object that is not named (paper, section III-H)."""
    if query.receives is None or not is_bare(query.reference):
        return
    share = options.flat_receiver_share if query.receives in (Primitive.PUT_ON, Primitive.STACK) else 1.0
    scores, _ = context.scores(CONTAINER)
    best = max(max(scores, default=0.0), options.container_min_best)
    for detection, score in zip(context.detections, scores, strict=True):
        if detection.id in factors:
            fit = float(np.log(max(score / best, options.container_min_share)))
            factors[detection.id]["plausible"] = context.weights.plausible * share * fit


def _add_reach(query: Query, context: Context, factors: Factors, options: ObjectLikelihoodOptions) -> None:
    """Slightly doubt objects that no arm reaches from here."""
    surface = context.surface
    if not surface.shoulders or query.receives is not None:
        return
    for name, own in factors.items():
        shape = context.footprints[name]
        if not shape.is_empty:
            centre = find_centre(shape)
            distance = min(float(np.linalg.norm(centre - np.array(s))) for s in surface.shoulders)
            excess = max(distance - surface.reach_max, 0.0)
            own["reach"] = max(-0.5 * (excess / options.reach_sigma_m) ** 2, options.reach_min_log)
