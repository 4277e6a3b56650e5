# SPDX-License-Identifier: Apache-2.0
"""Things set against each other: the left one, the biggest, the second from the left, the same colour as this.

All return log factors by the things' ids; 0 is the best.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from uncom_language.types import Reference
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import along_of, comparisons
from uncom_reasoner.exceptions import NotSupportedError
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.support.support_plane import centre_of, extent_of
from uncom_reasoner.types import Candidate

KIND_SHARE = 0.2  # things whose score is this share of the best are of the kind that is compared
RANK_LOG = -2.5  # for each place in the order of a comparison
LEAST_LOG = -6.0
LIKE_RATIO = 0.15  # sizes that differ by this share (in logarithms) are a standard deviation apart
CLEAR_RATIO = 0.05  # and one that is larger by this share is larger
LEAST_SHARE = 0.03  # of a colour or a kind that was not seen at all
IN_PLACE_M = 0.03  # the order of things whose places differ by less is not clear
IN_SIZE = 0.03  # and of sizes (in logarithms)

COLOURS = ("colour", "color")


def order_logs(reference: Reference, scores: Mapping[str, float], context: Context) -> dict[str, float]:
    """Weigh things by their place among their kind, for superlatives, sides and ordinals; {} where none was said."""
    ways = comparisons(reference)
    if not ways and not reference.ordinal:
        return {}
    best = max(scores.values(), default=0.0)
    kind = [context.thing(name) for name, score in scores.items() if score >= KIND_SHARE * best]
    logs = {thing.id: 0.0 for thing in kind}
    along = along_of(reference) if reference.ordinal else ""
    for way in (along, *(w for w in ways if w != along)) if along else ways:
        values = np.array([quantity(way, thing, context) for thing in kind])
        if way == "middle":
            values = -np.abs(values - np.median(values))
        wanted = 0
        if way == along:
            wanted = reference.ordinal - 1 if reference.ordinal > 0 else len(kind) + reference.ordinal
        scale = IN_PLACE_M * context.surface.unit if way in ("left", "right", "near", "far", "middle") else IN_SIZE
        for thing, rank in zip(kind, _soft_ranks(values, scale), strict=True):
            logs[thing.id] += max(RANK_LOG * abs(rank - wanted), 4.0 * RANK_LOG)
    return logs


def _soft_ranks(values: np.ndarray, scale: float) -> list[float]:
    """Return the place of each value in the order from the largest (0); values that are close share it."""
    ranks = []
    for value in values:
        ahead = 1.0 / (1.0 + np.exp(-np.clip((values - value) / (0.3 * scale), -40.0, 40.0)))
        ranks.append(float(ahead.sum() - 0.5))
    return ranks


def quantity(way: str, detection: Detection, context: Context) -> float:
    """Return the quantity of which the wanted thing has most: plane units for places, logarithms for sizes."""
    shape, surface = context.footprints[detection.id], context.surface
    centre = centre_of(shape) if not shape.is_empty else np.zeros(2)
    sides = {
        "left": -surface.right,
        "right": surface.right,
        "near": -surface.far,
        "far": surface.far,
        "middle": surface.right,
    }
    if way in sides:
        return float(centre @ sides[way])
    length, height, volume = extent_of(detection)
    sizes = {
        "large": np.log(volume) / 3.0,
        "small": -np.log(volume) / 3.0,
        "tall": np.log(height),
        "low": -np.log(height),
        "long": np.log(length),
    }
    return float(sizes[way])


def excluded_logs(reference: Reference, context: Context) -> dict[str, float]:
    """Doubt things that fit a word that was excluded ("not the red one")."""
    logs = dict.fromkeys((d.id for d in context.things), 0.0)
    if not reference.excluded_modifiers:
        return {}
    for word in reference.excluded_modifiers:
        scores, none = context.scores(word.lower())
        best = max(max(scores, default=0.0), 1e-9)
        for thing, score in zip(context.things, scores, strict=True):
            fit = score / best * (1.0 - none)  # scores are shared among the things that fit; this undoes it
            logs[thing.id] += float(np.log(max(1.0 - fit, LEAST_SHARE)))
    return logs


def likeness_logs(
    comparison: str, compared: Sequence[Candidate], scores: Mapping[str, float], context: Context
) -> dict[str, float]:
    """Weigh things by how they compare with another, whichever of its candidates that is; it is not the other itself.

    `scores` say how well the words fit each thing: "the nearest apple" is nearest among the apples.

    Raises:
        NotSupportedError: what is compared cannot be seen.
    """
    if comparison in ("nearest", "farthest"):
        return _ranked_by_distance(comparison, compared, scores, context)
    logs = {}
    for thing in context.things:
        terms = []
        for candidate in compared:
            if candidate.id in (thing.id, "none"):
                continue
            fit = _likeness(comparison, thing, context.thing(candidate.id))
            terms.append(float(np.log(max(candidate.probability, 1e-9))) + fit)
        logs[thing.id] = max(float(np.logaddexp.reduce(terms)), 2.0 * LEAST_LOG) if terms else 2.0 * LEAST_LOG
    return logs


def _likeness(comparison: str, thing: Detection, other: Detection) -> float:
    length, height, volume = extent_of(thing)
    other_length, other_height, other_volume = extent_of(other)
    ratios = {"bigger": np.log(volume / other_volume) / 3.0, "taller": np.log(height / other_height)}
    ratios["longer"] = np.log(length / other_length)
    ratios |= {"smaller": -ratios["bigger"], "shorter": -ratios["taller"]}
    if comparison in ratios:
        return max(-float(np.logaddexp(0.0, -(ratios[comparison] - CLEAR_RATIO) / (0.5 * CLEAR_RATIO))), LEAST_LOG)
    same = {
        "colour": same_colour(thing, other),
        "size": float(np.exp(-0.5 * (ratios["bigger"] / LIKE_RATIO) ** 2)),
        "shape": _same_shape(thing, other),
        "kind": _same_kind(thing, other),
    }
    how, _, what = comparison.partition("_")
    if comparison in ("similar", "different"):
        alike = float(np.mean(list(same.values())))
        alike = float(np.clip((alike - 0.35) / 0.5, 0.0, 1.0))
        how = "same" if comparison == "similar" else "other"
    elif what in same and how in ("same", "other"):
        alike = same[what]
    else:
        raise NotSupportedError(f"I cannot tell by looking which things have the {comparison.replace('_', ' ')}.")
    return float(np.log(max(alike if how == "same" else 1.0 - alike, LEAST_SHARE)))


def same_colour(thing: Detection, other: Detection) -> float:
    """Return how much of the colour (0 to 1) two things share."""
    shares = [{a.value: a.probability for a in d.attributes if a.name in COLOURS} for d in (thing, other)]
    totals = [sum(share.values()) for share in shares]
    if min(totals) <= 0.0:
        return 0.5  # not known
    common = set(shares[0]) & set(shares[1])
    return float(sum(min(shares[0][c] / totals[0], shares[1][c] / totals[1]) for c in common))


def _same_shape(thing: Detection, other: Detection) -> float:
    if thing.geometry is None or other.geometry is None:
        return 0.5
    a, b = (np.log(np.maximum(np.sort(d.geometry.size), 1e-3)) for d in (thing, other) if d.geometry is not None)
    offset = (a - a.mean()) - (b - b.mean())
    return float(np.exp(-0.5 * float(offset @ offset) / (2.0 * LIKE_RATIO) ** 2))


def _same_kind(thing: Detection, other: Detection) -> float:
    if not thing.label or not other.label:
        return 0.5
    sure = min(max(thing.score * other.score, 0.3), 0.97)
    return sure if thing.label == other.label else 1.0 - sure


def _ranked_by_distance(
    comparison: str, compared: Sequence[Candidate], scores: Mapping[str, float], context: Context
) -> dict[str, float]:
    """Weigh things of a kind by the order of their distances from the likeliest other thing."""
    other = next((c.id for c in compared if c.id != "none"), "")
    shapes = context.footprints
    best = max((score for name, score in scores.items() if name != other), default=0.0)
    kind = {name for name, score in scores.items() if score >= KIND_SHARE * best}
    things = [d for d in context.things if d.id in kind and d.id != other and not shapes[d.id].is_empty]
    logs = dict.fromkeys((d.id for d in context.things), 2.0 * LEAST_LOG)
    if not other or not things:
        return logs
    sign = -1.0 if comparison == "nearest" else 1.0
    gaps = np.array([sign * shapes[d.id].distance(shapes[other]) for d in things])
    for thing, rank in zip(things, _soft_ranks(gaps, IN_PLACE_M * context.surface.unit), strict=True):
        logs[thing.id] = max(RANK_LOG * rank, 4.0 * RANK_LOG)
    return logs
