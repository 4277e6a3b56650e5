# SPDX-License-Identifier: Apache-2.0
"""Which rays belong to which words, and how the rays of a dwell become one.

The paper takes the ray of one frame, the end of the phrase (section III-D, E). Here all frames around a phrase count:
they are cut into dwells (the hand points one way for a while), each dwell's rays are fused, and each phrase gets the
dwells around its own words with shares by time and stillness. A moving hand weighs little; a hand may come early or
stay late.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from uncom_common.transforms import apply
from uncom_language.types import Reference, Span
from uncom_perception.types import Hand, HandsFrame, PointingRay

from uncom_reasoner.pointing.ray_tracks import tracks_of
from uncom_reasoner.types import Dwell, FloatArray, PhraseRay, RayInSpace, RayObservation
from uncom_reasoner.weights import Weights

SPLIT_GAP_S = 0.45
SPLIT_ANGLE_RAD = 0.45
SPLIT_TIP_WIDTHS = 0.06  # of the image's width
# Two looks that a slow hand joins: their means differ by this much, in one or both together.
APART_TIP_WIDTHS = 0.03
APART_ANGLE_RAD = 0.2
LEAST_FRAMES = 2  # of a look
OTHER_HAND = 0.3  # what a hand counts that the gesture node does not call the pointing one
LEAST_SHARE = 0.4  # of the weight that makes a gesture: less is a hand passing by, more may be a hand seen late
INDEPENDENT_FRAMES = 4.0  # errors of neighbouring frames are alike, so that more frames than these do not help

TransformAt = Callable[[float], FloatArray | None]


def observe(frames: Sequence[HandsFrame], camera_to_scene_at: TransformAt) -> tuple[RayObservation, ...]:
    """Collect the rays of all frames, in the order of time; metric ones in the scene's frame."""
    found = []
    for frame in sorted(frames, key=lambda f: f.stamp_s):
        for index, hand in enumerate(frame.hands):
            if hand.ray is not None:
                share = 1.0 if frame.pointing_hand in (index, None) else OTHER_HAND
                found.append(_observation(frame, hand, hand.ray, share, camera_to_scene_at(frame.stamp_s)))
    return tuple(found)


def _observation(
    frame: HandsFrame, hand: Hand, ray: PointingRay, share: float, transform: FloatArray | None
) -> RayObservation:
    space = None
    if ray.metric is not None and transform is not None:
        direction = transform[:3, :3] @ ray.metric.direction
        direction = direction / np.linalg.norm(direction)
        space = RayInSpace(apply(transform, ray.metric.tip), direction, transform[:3, 3].copy())
    return RayObservation(
        stamp_s=frame.stamp_s,
        hand=hand.handedness,
        score=max(hand.score, 0.05) * share,
        sigma_rad=max(ray.sigma_rad, 0.01),
        width=frame.width,
        tip_px=np.asarray(ray.tip, dtype=float),
        base_px=np.asarray(ray.origin, dtype=float),
        direction_px=np.asarray(ray.direction, dtype=float),
        space=space,
    )


def dwells_of(observations: Sequence[RayObservation], weights: Weights) -> tuple[Dwell, ...]:
    """Cut the rays of each hand into stretches of pointing one way and fuse each."""
    dwells: list[Dwell] = []
    for track in tracks_of(observations):
        still = _stillness(track, weights.still_speed)
        looks = [look for part in _split(track) for look in _looks(part, track, still)]
        dwells.extend(_fuse([track[i] for i in look], [still[i] for i in look], weights) for look in looks)
    return tuple(sorted(dwells, key=lambda d: d.stamps_s[0]))


def _stillness(track: Sequence[RayObservation], half_speed: float) -> list[float]:
    """Weigh each frame (0..1) by how little the fingertip moves around it."""
    speeds = np.zeros(len(track))
    counts = np.zeros(len(track))
    for i, (a, b) in enumerate(pairwise(track)):
        gap = b.stamp_s - a.stamp_s
        if 0.0 < gap <= SPLIT_GAP_S:
            speed = float(np.linalg.norm(b.tip_px - a.tip_px)) / a.width / gap
            speeds[i : i + 2] += speed
            counts[i : i + 2] += 1.0
    mean = np.where(counts > 0, speeds / np.maximum(counts, 1.0), half_speed)
    return [float(o.score / (1.0 + (v / half_speed) ** 2)) for o, v in zip(track, mean, strict=True)]


def _split(track: Sequence[RayObservation]) -> list[list[int]]:
    """Split a track where the hand was away, turned or moved on (compared with the stretch so far)."""
    parts: list[list[int]] = []
    for i, o in enumerate(track):
        if parts:
            last = [track[k] for k in parts[-1][-3:]]
            tip = np.median([k.tip_px for k in last], axis=0)
            direction = np.mean([k.direction_px for k in last], axis=0)
            angle = _angle(direction, o.direction_px)
            far = float(np.linalg.norm(o.tip_px - tip)) / o.width
            if o.stamp_s - last[-1].stamp_s <= SPLIT_GAP_S and angle <= SPLIT_ANGLE_RAD and far <= SPLIT_TIP_WIDTHS:
                parts[-1].append(i)
                continue
        parts.append([i])
    return parts


def _looks(part: list[int], track: Sequence[RayObservation], still: Sequence[float]) -> list[list[int]]:
    """Divide a stretch without a jump where the hand has moved on slowly: in two, as unlike as can be, and so on."""
    places = np.array([np.r_[track[i].tip_px / track[i].width / APART_TIP_WIDTHS, _unit(track[i])] for i in part])
    weights = np.maximum([still[i] for i in part], 1e-6)[:, None]
    mass, moment = weights.cumsum(axis=0), (weights * places).cumsum(axis=0)
    cuts = np.arange(LEAST_FRAMES, len(part) - LEAST_FRAMES + 1)
    if cuts.size == 0:
        return [part]
    before, after = mass[cuts - 1], mass[-1] - mass[cuts - 1]
    distance = np.linalg.norm(moment[cuts - 1] / before - (moment[-1] - moment[cuts - 1]) / after, axis=1)
    # What a cut takes away from the spread within the parts.
    best = int(np.argmax((before * after)[:, 0] * distance**2))
    if distance[best] < 1.0:
        return [part]
    cut = int(cuts[best])
    return [*_looks(part[:cut], track, still), *_looks(part[cut:], track, still)]


def _unit(observation: RayObservation) -> FloatArray:
    """Return the direction in the image in units in which two looks are apart by 1."""
    d = observation.direction_px
    return np.asarray(d / (np.linalg.norm(d) * APART_ANGLE_RAD))


def _angle(a: FloatArray, b: FloatArray) -> float:
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.arccos(np.clip(float(a @ b) / norm, -1.0, 1.0))) if norm > 1e-9 else np.pi


def _fuse(track: Sequence[RayObservation], still: Sequence[float], weights: Weights) -> Dwell:
    w = np.maximum(np.asarray(still), 1e-6)
    tips = np.array([o.tip_px for o in track])
    direction_px, used = _robust_direction(np.array([o.direction_px for o in track]), w)
    w = w * used
    independent = min(float(w.sum() ** 2 / (w**2).sum()), INDEPENDENT_FRAMES)
    sigma = float(np.sqrt(np.average([o.sigma_rad**2 for o in track], weights=w) / independent))
    metric = [(o.space, float(x)) for o, x in zip(track, w, strict=True) if o.space is not None]
    m = np.array([x for _, x in metric])
    space = None
    if metric and m.sum() > 0.0 and m.sum() >= w.sum() / 3.0:
        direction, kept = _robust_direction(np.array([s.direction for s, _ in metric]), m)
        tip = _weighted_median(np.array([s.tip for s, _ in metric]), m * kept)
        space = RayInSpace(tip, direction, np.average(np.array([s.eye for s, _ in metric]), axis=0, weights=m))
    return Dwell(
        hand=track[0].hand,
        stamps_s=tuple(o.stamp_s for o in track),
        stillness=tuple(float(s) for s in still),
        sigma_rad=float(np.hypot(sigma, weights.ray_systematic_rad)),
        width=track[0].width,
        finger_px=float(np.median([np.linalg.norm(o.tip_px - o.base_px) for o in track])),
        tip_px=_weighted_median(tips, w),
        direction_px=direction_px,
        space=space,
    )


def _robust_direction(directions: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean unit direction without outliers, and 1 for each direction used."""
    centre = directions[int(np.argmax([np.sum(w * (directions @ d)) for d in directions]))]
    angles = np.arccos(np.clip(directions @ centre, -1.0, 1.0))
    limit = max(0.15, 2.5 * float(np.median(angles)))
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


def phrase_ray(
    role: str, span: Span, dwells: Sequence[Dwell], weights: Weights, others: Sequence[Span] = ()
) -> PhraseRay:
    """Give a phrase its dwells.

    Frames nearer to another phrase of the command count for that one, and so does most of a dwell that is mostly about
    another phrase: a hand that stays on the object a little into the next words does not point at the target.
    """
    scored = []
    for dwell in dwells:
        weight = other = 0.0
        for stamp, still in zip(dwell.stamps_s, dwell.stillness, strict=True):
            mine = _in_time(stamp, span, weights)
            theirs = max((_in_time(stamp, o, weights) for o in others), default=0.0)
            if mine + theirs > 0.0:
                weight += still * mine**2 / (mine + theirs)
                other += still * theirs**2 / (mine + theirs)
        if weight > 0.0:
            scored.append((dwell, weight * (weight / (weight + other)) ** 2))
    total = sum(weight for _, weight in scored)
    if total < weights.min_gesture_weight * LEAST_SHARE:
        return PhraseRay(role, span.start_s, span.end_s, (), total)
    # Attention goes to the longest look: squaring keeps a hand on its way from claiming a share.
    power = [(dwell, weight**2) for dwell, weight in scored if weight > 0.05 * total]
    norm = sum(weight for _, weight in power)
    shares = tuple((dwell, weight / norm) for dwell, weight in power)
    return PhraseRay(role, span.start_s, span.end_s, shares, total)


def _in_time(stamp_s: float, span: Span, weights: Weights) -> float:
    """Weigh a moment by its distance to a phrase: 1 in it, falling off before and after (Gaussian)."""
    if stamp_s < span.start_s:
        z = (span.start_s - stamp_s) / max(weights.early_s, 1e-3)
    elif stamp_s > span.end_s:
        z = (stamp_s - span.end_s) / max(weights.late_s, 1e-3)
    else:
        return 1.0
    return float(np.exp(-0.5 * z * z)) if z < 3.0 else 0.0
