# SPDX-License-Identifier: Apache-2.0
"""Objects set against each other: the left one, the biggest, the second from the left, the same colour as this.

All functions return log factors by the objects' ids; 0 is the best. Which colours an object has is decided by the
perception (uncom_perception/objects/attributes); here only shares of colours are compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from uncom_common.transforms import FloatArray
from uncom_language.types import Reference
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import comparison_axes, ordinal_axis
from uncom_reasoner.exceptions import NotSupportedError
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.options import COMPARISON, ComparisonOptions
from uncom_reasoner.support.support_plane import find_centre, measure_extent
from uncom_reasoner.types import Candidate

COLOURS = ("colour", "color")


def rank_logs(
    reference: Reference, scores: Mapping[str, float], context: Context, options: ComparisonOptions = COMPARISON
) -> dict[str, float]:
    """Weigh objects by their place among their kind, for superlatives, sides and ordinals; {} where none was said.

    Args:
        reference: the words.
        scores: how well the words fit each object; those that fit are the kind.
        context: of the decision.
        options: of comparisons.
    """
    axes = comparison_axes(reference)
    if not axes and not reference.ordinal:
        return {}
    best = max(scores.values(), default=0.0)
    kind = [context.detection(name) for name, score in scores.items() if score >= options.kind_share * best]
    logs = {detection.id: 0.0 for detection in kind}
    counted = ordinal_axis(reference) if reference.ordinal else ""
    for axis in (counted, *(a for a in axes if a != counted)) if counted else axes:
        values = np.array([measure_axis(axis, detection, context) for detection in kind])
        if axis == "middle":
            values = -np.abs(values - np.median(values))
        wanted = 0
        if axis == counted:
            wanted = reference.ordinal - 1 if reference.ordinal > 0 else len(kind) + reference.ordinal
        is_place = axis in ("left", "right", "near", "far", "middle")
        scale = options.clear_place_m * context.surface.units_per_m if is_place else options.clear_size_log
        for detection, rank in zip(kind, _soft_ranks(values, scale, options), strict=True):
            logs[detection.id] += _rank_log(abs(rank - wanted), options)
    return logs


def _rank_log(ranks: float, options: ComparisonOptions) -> float:
    return max(options.rank_log * ranks, options.max_ranks * options.rank_log)


def _soft_ranks(values: FloatArray, scale: float, options: ComparisonOptions) -> list[float]:
    """Return the place of each value in the order from the largest (0); values that are close share it.

    Args:
        values: (N,) to be ordered.
        scale: difference that is clear.
        options: of the softness.
    """
    softness = options.rank_softness * scale
    ranks = []
    for value in values:
        ahead = 1.0 / (1.0 + np.exp(-np.clip((values - value) / softness, -40.0, 40.0)))
        ranks.append(float(ahead.sum() - 0.5))
    return ranks


def measure_axis(axis: str, detection: Detection, context: Context) -> float:
    """Return the quantity of which the wanted object has most: plane units for places, logarithms for sizes."""
    shape, surface = context.footprints[detection.id], context.surface
    centre = find_centre(shape) if not shape.is_empty else np.zeros(2)
    sides = {
        "left": -surface.right,
        "right": surface.right,
        "near": -surface.far,
        "far": surface.far,
        "middle": surface.right,
    }
    if axis in sides:
        return float(centre @ sides[axis])
    length, height, volume = measure_extent(detection)
    sizes = {
        "large": np.log(volume) / 3.0,
        "small": -np.log(volume) / 3.0,
        "tall": np.log(height),
        "low": -np.log(height),
        "long": np.log(length),
    }
    return float(sizes[axis])


def exclusion_logs(reference: Reference, context: Context, options: ComparisonOptions = COMPARISON) -> dict[str, float]:
    """Doubt objects that fit a word that was excluded ("not the red one"); {} where none was."""
    logs = dict.fromkeys((d.id for d in context.detections), 0.0)
    if not reference.excluded_modifiers:
        return {}
    for word in reference.excluded_modifiers:
        scores, none = context.scores(word.lower())
        best = max(max(scores, default=0.0), 1e-9)
        for detection, score in zip(context.detections, scores, strict=True):
            fit = score / best * (1.0 - none)  # scores are shared among the objects that fit; this undoes it
            logs[detection.id] += float(np.log(max(1.0 - fit, options.min_share)))
    return logs


def comparison_logs(
    comparison: str,
    compared: Sequence[Candidate],
    scores: Mapping[str, float],
    context: Context,
    options: ComparisonOptions = COMPARISON,
) -> dict[str, float]:
    """Weigh objects by how they compare with another, whichever of its candidates that is; never that one itself.

    Args:
        comparison: "nearest", "farthest", "bigger", "same_colour", "other_kind", "similar", ...
        compared: candidates of the object that is compared with.
        scores: how well the words fit each object: "the nearest apple" is nearest among the apples.
        context: of the decision.
        options: of comparisons.

    Raises:
        NotSupportedError: what is compared cannot be seen.
    """
    if comparison in ("nearest", "farthest"):
        return _distance_rank_logs(comparison, compared, scores, context, options)
    least = 2.0 * options.compared_min_log
    logs = {}
    for detection in context.detections:
        terms = []
        for candidate in compared:
            if candidate.id in (detection.id, "none"):
                continue
            fit = _compare(comparison, detection, context.detection(candidate.id), options)
            terms.append(float(np.log(max(candidate.probability, 1e-9))) + fit)
        logs[detection.id] = max(float(np.logaddexp.reduce(terms)), least) if terms else least
    return logs


def _compare(comparison: str, detection: Detection, other: Detection, options: ComparisonOptions) -> float:
    """Return how well an object compares with another in the way that was said, as a natural log."""
    length, height, volume = measure_extent(detection)
    other_length, other_height, other_volume = measure_extent(other)
    ratios = {"bigger": np.log(volume / other_volume) / 3.0, "taller": np.log(height / other_height)}
    ratios["longer"] = np.log(length / other_length)
    ratios |= {"smaller": -ratios["bigger"], "shorter": -ratios["taller"]}
    if comparison in ratios:
        excess = (ratios[comparison] - options.larger_log) / (options.larger_softness * options.larger_log)
        return max(-float(np.logaddexp(0.0, -excess)), options.compared_min_log)
    same = {
        "colour": same_colour(detection, other, options),
        "size": float(np.exp(-0.5 * (ratios["bigger"] / options.same_size_sigma) ** 2)),
        "shape": _same_shape(detection, other, options),
        "kind": _same_kind(detection, other, options),
    }
    how, _, what = comparison.partition("_")
    if comparison in ("similar", "different"):
        alike = float(np.mean(list(same.values())))
        alike = float(np.clip((alike - options.similar_low) / options.similar_range, 0.0, 1.0))
        how = "same" if comparison == "similar" else "other"
    elif what in same and how in ("same", "other"):
        alike = same[what]
    else:
        raise NotSupportedError(f"I cannot tell by looking which things have the {comparison.replace('_', ' ')}.")
    return float(np.log(max(alike if how == "same" else 1.0 - alike, options.min_share)))


def same_colour(detection: Detection, other: Detection, options: ComparisonOptions = COMPARISON) -> float:
    """Return how much of the colour (0 to 1) two objects share."""
    shares = [{a.value: a.probability for a in d.attributes if a.name in COLOURS} for d in (detection, other)]
    totals = [sum(share.values()) for share in shares]
    if min(totals) <= 0.0:
        return options.unknown_likeness
    common = set(shares[0]) & set(shares[1])
    return float(sum(min(shares[0][c] / totals[0], shares[1][c] / totals[1]) for c in common))


def _same_shape(detection: Detection, other: Detection, options: ComparisonOptions) -> float:
    if detection.geometry is None or other.geometry is None:
        return options.unknown_likeness
    sizes = (np.sort(d.geometry.size) for d in (detection, other) if d.geometry is not None)
    a, b = (np.log(np.maximum(size, options.min_extent_m)) for size in sizes)
    offset = (a - a.mean()) - (b - b.mean())
    sigma = options.same_shape_sigmas * options.same_size_sigma
    return float(np.exp(-0.5 * float(offset @ offset) / sigma**2))


def _same_kind(detection: Detection, other: Detection, options: ComparisonOptions) -> float:
    if not detection.label or not other.label:
        return options.unknown_likeness
    sure = min(max(detection.score * other.score, options.label_sure_min), options.label_sure_max)
    return sure if detection.label == other.label else 1.0 - sure


def _distance_rank_logs(
    comparison: str,
    compared: Sequence[Candidate],
    scores: Mapping[str, float],
    context: Context,
    options: ComparisonOptions,
) -> dict[str, float]:
    """Weigh objects of a kind by the order of their distances from the likeliest other object."""
    other = next((c.id for c in compared if c.id != "none"), "")
    shapes = context.footprints
    best = max((score for name, score in scores.items() if name != other), default=0.0)
    kind = {name for name, score in scores.items() if score >= options.kind_share * best}
    ranked = [d for d in context.detections if d.id in kind and d.id != other and not shapes[d.id].is_empty]
    logs = dict.fromkeys((d.id for d in context.detections), 2.0 * options.compared_min_log)
    if not other or not ranked:
        return logs
    sign = -1.0 if comparison == "nearest" else 1.0
    gaps = np.array([sign * shapes[d.id].distance(shapes[other]) for d in ranked])
    scale = options.clear_place_m * context.surface.units_per_m
    for detection, rank in zip(ranked, _soft_ranks(gaps, scale, options), strict=True):
        logs[detection.id] = _rank_log(rank, options)
    return logs
