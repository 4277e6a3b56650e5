# SPDX-License-Identifier: Apache-2.0
"""Short losses of a pointing hand, bridged between the images before and after in which it was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from uncom_perception.hands.options import HAND_BRIDGE, HandBridgeOptions
from uncom_perception.types import FloatArray, Hand, HandsFrame, MetricRay, PointingRay


class HandBridge:
    """Holds back images in which a pointing hand is lost, for a short time, and fills them in when it is seen again.

    A hand that is not seen again within that time is never made up: the images go out as they are.
    """

    def __init__(self, longest_s: float, *, options: HandBridgeOptions = HAND_BRIDGE) -> None:
        """Bridge losses of up to longest_s; with 0 nothing is held back."""
        self._options = options
        self._longest_s = longest_s
        self._before: HandsFrame | None = None
        self._held: list[HandsFrame] = []

    def add(self, frame: HandsFrame) -> list[HandsFrame]:
        """Take in the hands of the next image; return those that are ready, in the order of time."""
        before = self._before
        if before is None or not 0.0 < frame.stamp_s - before.stamp_s <= self._longest_s:
            ready = [*self._held, frame]
            self._held = []
            self._before = frame if frame.pointing_hand is not None else None
            return ready
        if frame.pointing_hand is None and not frame.hands:
            self._held.append(frame)
            return []
        ready = [_between(before, frame, lost, options=self._options) for lost in self._held]
        self._held = []
        self._before = frame if frame.pointing_hand is not None else None
        return [*ready, frame]


def _pointing(frame: HandsFrame) -> tuple[Hand, PointingRay] | None:
    if frame.pointing_hand is None:
        return None
    hand = frame.hands[frame.pointing_hand]
    return (hand, hand.ray) if hand.ray is not None else None


def _between(
    before: HandsFrame, after: HandsFrame, lost: HandsFrame, *, options: HandBridgeOptions = HAND_BRIDGE
) -> HandsFrame:
    """Return a frame in which the hand is where it must have been, or the frame as it is if that is not known."""
    first, last = _pointing(before), _pointing(after)
    if first is None or last is None:
        return lost
    (a, ray_a), (b, ray_b) = first, last
    size = float(np.ptp(a.landmarks[:, :2], axis=0).max())
    moved = float(np.median(np.linalg.norm(a.landmarks[:, :2] - b.landmarks[:, :2], axis=1)))
    turned = float(np.arccos(np.clip(np.dot(ray_a.direction, ray_b.direction), -1.0, 1.0)))
    if a.handedness != b.handedness or moved > options.moved * size or turned > options.turned_rad:
        return lost
    share = (lost.stamp_s - before.stamp_s) / (after.stamp_s - before.stamp_s)
    unseen_s = min(lost.stamp_s - before.stamp_s, after.stamp_s - lost.stamp_s)
    sigma = max(ray_a.sigma_rad, ray_b.sigma_rad) + 0.5 * turned + options.growth_rad_s * unseen_s
    metric = None
    if ray_a.metric is not None and ray_b.metric is not None:
        m, n = ray_a.metric, ray_b.metric
        metric = MetricRay(
            _mix(m.origin, n.origin, share), _mix(m.tip, n.tip, share), _unit(_mix(m.direction, n.direction, share))
        )
    ends = [_mix(np.array(getattr(ray_a, k)), np.array(getattr(ray_b, k)), share) for k in ("origin", "tip")]
    direction = _unit(_mix(np.array(ray_a.direction), np.array(ray_b.direction), share))
    ray = PointingRay(_pair(ends[0]), _pair(ends[1]), _pair(direction), sigma, metric, ray_a.style)
    score = min(a.score, b.score) * 0.5
    hand = Hand(a.handedness, score, _mix(a.landmarks, b.landmarks, share), ray, 0.5 * (a.depth_m + b.depth_m))
    return replace(lost, hands=(hand,), pointing_hand=0, backend=f"{lost.backend}, bridged")


def _mix(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    return (1.0 - share) * a + share * b


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9))


def _pair(vector: FloatArray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])
