# SPDX-License-Identifier: Apache-2.0
"""Which rays belong to which words, and how the rays of a dwell are fused.

The paper takes the ray of one frame, the end of the phrase (section III-D, E). Here all frames around a phrase count:
they are cut into dwells (stretches in which the hand points one way), each dwell's rays are fused, and each phrase gets
the dwells around its own words with shares by time and stillness. A moving hand weighs little; a hand may come early or
stay late: how fast a late or early pointing loses weight are the weights `late_s` and `early_s`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from uncom_common.transforms import FloatArray, apply
from uncom_language.types import Reference, Span
from uncom_perception.types import Hand, HandsFrame, PointingRay

from uncom_reasoner.gesture_types import Dwell, PhraseRay, RayInSpace, RayObservation
from uncom_reasoner.pointing.options import RAY_FUSION, RayFusionOptions
from uncom_reasoner.pointing.ray_tracks import associate_rays
from uncom_reasoner.weights import Weights

TransformAt = Callable[[float], FloatArray | None]  # (4, 4) camera to scene at a stamp [s]


def observe_rays(
    frames: Sequence[HandsFrame], camera_to_scene_at: TransformAt, options: RayFusionOptions = RAY_FUSION
) -> tuple[RayObservation, ...]:
    """Collect the rays of all frames, in the order of time; metric ones in the scene's frame."""
    found = []
    for frame in sorted(frames, key=lambda f: f.stamp_s):
        for index, hand in enumerate(frame.hands):
            if hand.ray is not None:
                share = 1.0 if frame.pointing_hand in (index, None) else options.other_hand_share
                transform = camera_to_scene_at(frame.stamp_s)
                found.append(_make_observation(frame, hand, hand.ray, share, transform, options))
    return tuple(found)


def _make_observation(
    frame: HandsFrame,
    hand: Hand,
    ray: PointingRay,
    share: float,
    transform: FloatArray | None,
    options: RayFusionOptions,
) -> RayObservation:
    space = None
    if ray.metric is not None and transform is not None:
        direction = transform[:3, :3] @ ray.metric.direction
        direction = direction / np.linalg.norm(direction)
        space = RayInSpace(apply(transform, ray.metric.tip), direction, transform[:3, 3].copy())
    return RayObservation(
        stamp_s=frame.stamp_s,
        hand=hand.handedness,
        score=max(hand.score, options.min_hand_score) * share,
        sigma_rad=max(ray.sigma_rad, options.min_sigma_rad),
        width=frame.width,
        tip_px=np.asarray(ray.tip, dtype=float),
        base_px=np.asarray(ray.origin, dtype=float),
        direction_px=np.asarray(ray.direction, dtype=float),
        space=space,
    )


def segment_dwells(
    observations: Sequence[RayObservation], weights: Weights, options: RayFusionOptions = RAY_FUSION
) -> tuple[Dwell, ...]:
    """Cut the rays of each hand into stretches of pointing one way and fuse each."""
    dwells: list[Dwell] = []
    for track in associate_rays(observations):
        stillness = _measure_stillness(track, weights.still_speed, options)
        stretches = _split_at_jumps(track, options)
        parts = [part for stretch in stretches for part in _cut_slow_motion(stretch, track, stillness, options)]
        dwells.extend(_fuse([track[i] for i in part], [stillness[i] for i in part], weights, options) for part in parts)
    return tuple(sorted(dwells, key=lambda d: d.stamps_s[0]))


def _measure_stillness(track: Sequence[RayObservation], half_speed: float, options: RayFusionOptions) -> list[float]:
    """Weigh each frame (0 to 1) by how little the fingertip moves around it.

    Args:
        track: rays of one hand.
        half_speed: speed at which a frame counts half [image widths / s].
        options: of the longest gap between frames whose motion is known.
    """
    speeds = np.zeros(len(track))
    counts = np.zeros(len(track))
    for i, (a, b) in enumerate(pairwise(track)):
        gap_s = b.stamp_s - a.stamp_s
        if 0.0 < gap_s <= options.split_gap_s:
            speed = float(np.linalg.norm(b.tip_px - a.tip_px)) / a.width / gap_s
            speeds[i : i + 2] += speed
            counts[i : i + 2] += 1.0
    mean = np.where(counts > 0, speeds / np.maximum(counts, 1.0), half_speed)
    return [float(o.score / (1.0 + (v / half_speed) ** 2)) for o, v in zip(track, mean, strict=True)]


def _split_at_jumps(track: Sequence[RayObservation], options: RayFusionOptions) -> list[list[int]]:
    """Split a track where the hand was away, turned or moved on (compared with the last frames)."""
    parts: list[list[int]] = []
    for i, o in enumerate(track):
        if parts:
            last = [track[k] for k in parts[-1][-options.split_frames :]]
            tip = np.median([k.tip_px for k in last], axis=0)
            angle = _angle_between(np.mean([k.direction_px for k in last], axis=0), o.direction_px)
            distance = float(np.linalg.norm(o.tip_px - tip)) / o.width
            is_near = angle <= options.split_angle_rad and distance <= options.split_tip_widths
            if o.stamp_s - last[-1].stamp_s <= options.split_gap_s and is_near:
                parts[-1].append(i)
                continue
        parts.append([i])
    return parts


def _cut_slow_motion(
    part: list[int], track: Sequence[RayObservation], stillness: Sequence[float], options: RayFusionOptions
) -> list[list[int]]:
    """Divide a stretch without a jump where the hand has moved on slowly: in two, as unlike as can be, and so on."""
    features = np.array(
        [
            np.r_[track[i].tip_px / track[i].width / options.cut_tip_widths, _scaled_direction(track[i], options)]
            for i in part
        ]
    )
    weights = np.maximum([stillness[i] for i in part], 1e-6)[:, None]
    mass, moment = weights.cumsum(axis=0), (weights * features).cumsum(axis=0)
    cuts = np.arange(options.min_dwell_frames, len(part) - options.min_dwell_frames + 1)
    if cuts.size == 0:
        return [part]
    before, after = mass[cuts - 1], mass[-1] - mass[cuts - 1]
    distance = np.linalg.norm(moment[cuts - 1] / before - (moment[-1] - moment[cuts - 1]) / after, axis=1)
    # What a cut takes away from the spread within the parts.
    best = int(np.argmax((before * after)[:, 0] * distance**2))
    if distance[best] < 1.0:
        return [part]
    cut = int(cuts[best])
    return [
        *_cut_slow_motion(part[:cut], track, stillness, options),
        *_cut_slow_motion(part[cut:], track, stillness, options),
    ]


def _scaled_direction(observation: RayObservation, options: RayFusionOptions) -> FloatArray:
    """Return the direction in the image (2,) in units in which two dwells are apart by 1."""
    d = observation.direction_px
    return np.asarray(d / (np.linalg.norm(d) * options.cut_angle_rad))


def _angle_between(a: FloatArray, b: FloatArray) -> float:
    """Return the angle [rad] between two vectors; pi where one has no length."""
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return np.pi if math.isclose(norm, 0.0, abs_tol=1e-9) else float(np.arccos(np.clip(float(a @ b) / norm, -1.0, 1.0)))


def _fuse(
    track: Sequence[RayObservation], stillness: Sequence[float], weights: Weights, options: RayFusionOptions
) -> Dwell:
    """Fuse rays of pointing one way: robust mean direction, weighted median fingertip, errors that average out."""
    w = np.maximum(np.asarray(stillness), 1e-6)
    tips = np.array([o.tip_px for o in track])
    direction_px, used = _robust_direction(np.array([o.direction_px for o in track]), w, options)
    w = w * used
    independent = min(float(w.sum() ** 2 / (w**2).sum()), options.independent_frames)
    sigma = float(np.sqrt(np.average([o.sigma_rad**2 for o in track], weights=w) / independent))
    metric = [(o.space, float(x)) for o, x in zip(track, w, strict=True) if o.space is not None]
    m = np.array([x for _, x in metric])
    space = None
    if metric and m.sum() > 0.0 and m.sum() >= w.sum() / options.metric_divisor:
        direction, kept = _robust_direction(np.array([s.direction for s, _ in metric]), m, options)
        tip = _weighted_median(np.array([s.tip for s, _ in metric]), m * kept)
        space = RayInSpace(tip, direction, np.average(np.array([s.eye for s, _ in metric]), axis=0, weights=m))
    return Dwell(
        hand=track[0].hand,
        stamps_s=tuple(o.stamp_s for o in track),
        stillness=tuple(float(s) for s in stillness),
        sigma_rad=float(np.hypot(sigma, weights.ray_systematic_rad)),
        width=track[0].width,
        finger_px=float(np.median([np.linalg.norm(o.tip_px - o.base_px) for o in track])),
        tip_px=_weighted_median(tips, w),
        direction_px=direction_px,
        space=space,
    )


def _robust_direction(
    directions: FloatArray, w: FloatArray, options: RayFusionOptions
) -> tuple[FloatArray, FloatArray]:
    """Return the mean unit direction without outliers, and 1 for each direction used (else 0)."""
    centre = directions[int(np.argmax([np.sum(w * (directions @ d)) for d in directions]))]
    angles = np.arccos(np.clip(directions @ centre, -1.0, 1.0))
    limit = max(options.outlier_min_rad, options.outlier_medians * float(np.median(angles)))
    used = (angles <= limit).astype(float)
    mean = (directions * (w * used)[:, None]).sum(axis=0)
    return np.asarray(mean / np.linalg.norm(mean)), used


def _weighted_median(values: FloatArray, w: FloatArray) -> FloatArray:
    result = []
    for column in values.T:
        order = np.argsort(column)
        share = np.cumsum(w[order]) / max(float(w.sum()), 1e-12)
        result.append(float(column[order][int(np.searchsorted(share, 0.5))]))
    return np.array(result)


def phrase_span(reference: Reference) -> Span:
    """Return the time a gesture for a reference is looked for: the phrase with its deictic word."""
    span, deictic = reference.span, reference.deictic_span
    if deictic is None or deictic.end_s <= deictic.start_s:
        return span
    return Span(min(span.start_s, deictic.start_s), max(span.end_s, deictic.end_s))


def assign_dwells(
    role: str,
    span: Span,
    dwells: Sequence[Dwell],
    weights: Weights,
    other_spans: Sequence[Span] = (),
    options: RayFusionOptions = RAY_FUSION,
) -> PhraseRay:
    """Give a phrase its dwells.

    Frames nearer to another phrase of the command count for that one, and so does most of a dwell that is mostly about
    another phrase: a hand that stays on the object a little into the next words does not point at the target.

    Args:
        role: part of the command that the phrase is.
        span: time of the phrase's words.
        dwells: of all hands.
        weights: how fast early and late pointing loses weight, and how much makes a gesture.
        other_spans: times of the command's other phrases.
        options: of the shares.
    """
    scored = []
    for dwell in dwells:
        own = other = 0.0
        for stamp_s, stillness in zip(dwell.stamps_s, dwell.stillness, strict=True):
            own_fit = _fit_in_time(stamp_s, span, weights, options)
            other_fit = max((_fit_in_time(stamp_s, o, weights, options) for o in other_spans), default=0.0)
            if own_fit + other_fit > 0.0:
                own += stillness * own_fit**2 / (own_fit + other_fit)
                other += stillness * other_fit**2 / (own_fit + other_fit)
        if own > 0.0:
            scored.append((dwell, own * (own / (own + other)) ** 2))
    total = sum(weight for _, weight in scored)
    if total < weights.min_gesture_weight * options.min_weight_share:
        return PhraseRay(role, span.start_s, span.end_s, (), total)
    # Attention goes to the longest dwell: squaring keeps a hand on its way from claiming a share.
    squared = [(dwell, weight**2) for dwell, weight in scored if weight > options.min_share * total]
    norm = sum(weight for _, weight in squared)
    shares = tuple((dwell, weight / norm) for dwell, weight in squared)
    return PhraseRay(role, span.start_s, span.end_s, shares, total)


def _fit_in_time(stamp_s: float, span: Span, weights: Weights, options: RayFusionOptions) -> float:
    """Weigh a moment by its distance to a phrase: 1 in it, falling off before and after (Gaussian)."""
    if stamp_s < span.start_s:
        z = (span.start_s - stamp_s) / max(weights.early_s, 1e-3)
    elif stamp_s > span.end_s:
        z = (stamp_s - span.end_s) / max(weights.late_s, 1e-3)
    else:
        return 1.0
    return float(np.exp(-0.5 * z * z)) if z < options.time_cutoff else 0.0
