# SPDX-License-Identifier: Apache-2.0
"""Finding hands with second looks where the first one fails. Never invents a hand: every one was seen by the detector."""

from __future__ import annotations

from itertools import islice

import numpy as np

from uncom_perception.hands.detector import INDEX_MCP, MIDDLE_MCP, PINKY_MCP, WRIST, HandDetector, RawHand, RgbImage
from uncom_perception.hands.views import View, around, second_looks

_MIN_AGREEMENT = 0.25  # of the hand's size: how far the landmarks of a second look and its confirmation may differ


class HandFinder:
    """Looks at an image, and again where a hand is to be expected.

    A hand of a second look counts only if the detector, looking once more closely about it, sees the same hand: the
    second looks find more hands, and their confirmation keeps false ones out.
    """

    def __init__(self, detector: HandDetector, *, lite: HandDetector | None = None, keep_s: float = 0.7) -> None:
        """Look with a detector (and a lite one, whose palm model sees other hands); expect a hand for keep_s."""
        self._detector = detector
        self._lite = lite
        self._keep_s = keep_s
        self._last: tuple[RawHand, ...] = ()
        self._last_stamp_s = -np.inf
        self._rotation = 0

    @property
    def name(self) -> str:
        """Back end as told in every result."""
        return self._detector.name

    def find(self, image_rgb: RgbImage, stamp_s: float, *, thorough: bool = False) -> tuple[RawHand, ...]:
        """Return at most two hands of an image (H, W, 3) uint8, best first.

        Thorough (single pictures, or a hand is expected): all second looks; else one a frame by turns.
        """
        hands = _plausible(self._detector.detect(image_rgb))
        recent = 0.0 <= stamp_s - self._last_stamp_s <= self._keep_s
        if not hands and recent:
            hands = self._look_where_it_was(image_rgb)
        if not hands:
            hands = self._look_elsewhere(image_rgb, thorough=thorough)
        if hands:
            self._last, self._last_stamp_s = hands, stamp_s
        elif stamp_s < self._last_stamp_s:
            self._last_stamp_s = -np.inf  # time jumped back: a bag was started again
        return hands

    def _look_where_it_was(self, image_rgb: RgbImage) -> tuple[RawHand, ...]:
        found = []
        for hand in self._last:
            center = hand.landmarks[:, :2].mean(axis=0)
            for factor, turns in ((2.6, 0), (2.6, 2), (4.0, 0)):
                seen = self._confirmed(image_rgb, around(center, factor * hand.size_px, image_rgb.shape, turns))
                if seen:
                    found.append(seen)
                    break
        return tuple(found)

    def _look_elsewhere(self, image_rgb: RgbImage, *, thorough: bool) -> tuple[RawHand, ...]:
        if thorough and self._lite is not None:
            for hand in _plausible(self._lite.detect(image_rgb)):
                better = self._close_look(image_rgb, hand)
                if better is not None:
                    return (better,)
        views = list(second_looks(image_rgb.shape))
        if not thorough:
            self._rotation += 1
            start = self._rotation % len(views)
            views = list(islice(views, start, start + 1))
        for view in views:
            seen = self._confirmed(image_rgb, view)
            if seen:
                return (seen,)
        return ()

    def _confirmed(self, image_rgb: RgbImage, view: View) -> RawHand | None:
        for hand in _plausible(tuple(view.back(h) for h in self._detector.detect(view.cut(image_rgb)))):
            better = self._close_look(image_rgb, hand)
            if better is not None:
                return better
        return None

    def _close_look(self, image_rgb: RgbImage, hand: RawHand) -> RawHand | None:
        """Return the hand as seen once more from near, or None if it is not the same one there."""
        center = hand.landmarks[:, :2].mean(axis=0)
        for factor, turns in ((2.4, 0), (1.8, 0), (2.4, 2)):
            view = around(center, factor * hand.size_px, image_rgb.shape, turns)
            for again in self._detector.detect(view.cut(image_rgb)):
                seen = view.back(again)
                difference = np.linalg.norm(seen.landmarks[:, :2] - hand.landmarks[:, :2], axis=1)
                if np.median(difference) < _MIN_AGREEMENT * hand.size_px:
                    return seen
        return None


def _plausible(hands: tuple[RawHand, ...]) -> tuple[RawHand, ...]:
    """Drop what has no palm (degenerate landmarks) and the second of two that lie on one another."""
    kept: list[RawHand] = []
    for hand in hands:
        marks = hand.landmarks[:, :2]
        if hand.size_px < 12.0:
            continue
        palm = marks[[WRIST, INDEX_MCP, MIDDLE_MCP, PINKY_MCP]]
        if np.ptp(palm, axis=0).max() < 0.15 * hand.size_px:
            continue
        if any(np.median(np.linalg.norm(marks - k.landmarks[:, :2], axis=1)) < 0.3 * k.size_px for k in kept):
            continue
        kept.append(hand)
    return tuple(kept[:2])
