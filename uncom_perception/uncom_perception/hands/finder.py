# SPDX-License-Identifier: Apache-2.0
"""Finding hands, with second looks where the first one fails; every hand was seen by the detector, none is invented."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice

import numpy as np

from uncom_perception.hands.detector import (
    INDEX_MCP,
    INDEX_TIP,
    MIDDLE_MCP,
    PINKY_MCP,
    WRIST,
    HandDetector,
    RawHand,
    RgbImage,
)
from uncom_perception.hands.motion import MotionWatch, Newcomer
from uncom_perception.hands.views import View, around, second_looks, whole

_AGREEMENT = 0.25  # of the hand's size: how far the landmarks of two looks at one hand may differ
_CLEAR = 0.6  # evidence for pointing above which no other look is needed
_MAX_LOOKS = 6


class HandFinder:
    """Looks at an image, and again where a hand is to be expected or was seen unclearly.

    A hand of a second look counts only if another look sees the same hand: second looks find more hands, and the
    agreement of two keeps false ones out.
    """

    def __init__(
        self,
        detector: HandDetector,
        *,
        lite: HandDetector | None = None,
        evidence: Callable[[RawHand], float] | None = None,
        keep_s: float = 0.7,
    ) -> None:
        """Look with a detector.

        Args:
            detector: the main one.
            lite: another one, which sees other hands.
            evidence: how clearly a hand points, 0 to 1; an unclear hand gets another look.
            keep_s: how long a hand is expected after it was last seen [s].
        """
        self._detector = detector
        self._lite = lite
        self._evidence = evidence
        self._keep_s = keep_s
        self._watch = MotionWatch()
        self._last: tuple[RawHand, ...] = ()
        self._last_stamp_s = -np.inf
        self._turn = 0

    @property
    def name(self) -> str:
        """Back end as told in every result."""
        return self._detector.name

    def find(self, image_rgb: RgbImage, stamp_s: float, *, thorough: bool = False) -> tuple[RawHand, ...]:
        """Return at most two hands of an image (H, W, 3) uint8, best first.

        Thorough is for single pictures: all second looks. In a stream they are taken where a hand was a moment ago,
        where something has come into the picture, and elsewhere one a frame by turns.
        """
        hands = _plausible(self._detector.detect(image_rgb))
        newcomer = self._watch.changed(image_rgb)
        if hands:
            hands = tuple(self._settled(image_rgb, hand) for hand in hands)
        else:
            hands = self._look_again(image_rgb, stamp_s, newcomer, thorough=thorough)
        if hands:
            self._last, self._last_stamp_s = hands, stamp_s
        elif stamp_s < self._last_stamp_s:
            self._last_stamp_s = -np.inf  # time jumped back: a bag was started again
        return hands

    def _settled(self, image_rgb: RgbImage, hand: RawHand) -> RawHand:
        """Return a hand as two looks agree to see it, where the first one does not clearly see it pointing."""
        if self._evidence is None or self._evidence(hand) >= _CLEAR:
            return hand
        clear: list[RawHand] = []
        for seen in self._closer_looks(image_rgb, hand):
            if np.linalg.norm(_middle(seen) - _middle(hand)) > 0.6 * max(hand.size_px, seen.size_px):
                continue
            if self._evidence(seen) < _CLEAR:
                continue
            if any(_same(seen, other) for other in clear) or _same(seen, hand):
                return seen
            clear.append(seen)
        return hand

    def _closer_looks(self, image_rgb: RgbImage, hand: RawHand) -> Iterator[RawHand]:
        if self._lite is not None:
            yield from _plausible(self._lite.detect(image_rgb))
        for factor, turns in ((3.5, 0), (2.4, 2), (3.5, 1)):
            view = around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns)
            yield from _plausible(self._seen_in(image_rgb, view))

    def _look_again(
        self, image_rgb: RgbImage, stamp_s: float, newcomer: Newcomer | None, *, thorough: bool
    ) -> tuple[RawHand, ...]:
        expected = 0.0 <= stamp_s - self._last_stamp_s <= self._keep_s
        views: list[View] = []
        if expected:
            for hand in self._last:
                for factor, turns in ((2.6, 0), (2.6, 2), (4.0, 0)):
                    views.append(around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns))
        if newcomer is not None:
            views += _views_of(newcomer, image_rgb.shape)
        views = views[: _MAX_LOOKS + 2]
        elsewhere = list(second_looks(image_rgb.shape))
        if thorough:
            views += elsewhere
        elif not views:
            self._turn += 1
            start = self._turn % len(elsewhere)
            views += islice(elsewhere, start, start + 1)
        use_lite = thorough or expected or newcomer is not None
        return self._agreed(image_rgb, views, use_lite=use_lite)

    def _agreed(self, image_rgb: RgbImage, views: Iterable[View], *, use_lite: bool) -> tuple[RawHand, ...]:
        """Return the first hand that two looks agree on."""
        seen: list[RawHand] = []

        def agree(hand: RawHand) -> RawHand | None:
            for other in seen:
                if _same(hand, other):
                    return max(hand, other, key=self._evidence or (lambda h: h.score))
            return None

        def looks() -> Iterator[RawHand]:
            if use_lite and self._lite is not None:
                for hand in _plausible(self._lite.detect(image_rgb)):
                    yield hand
                    yield from self._confirmations(image_rgb, hand)
            for view in views:
                for hand in _plausible(self._seen_in(image_rgb, view)):
                    yield hand
                    yield from self._confirmations(image_rgb, hand)

        for hand in looks():
            both = agree(hand)
            if both is not None:
                return (self._settled(image_rgb, both),)
            seen.append(hand)
        return ()

    def _confirmations(self, image_rgb: RgbImage, hand: RawHand) -> Iterator[RawHand]:
        for factor, turns in ((2.4, 0), (3.5, 0), (1.7, 0), (2.4, 2)):
            view = around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns)
            yield from _plausible(self._seen_in(image_rgb, view))

    def _seen_in(self, image_rgb: RgbImage, view: View) -> tuple[RawHand, ...]:
        return tuple(view.back(hand) for hand in self._detector.detect(view.cut(image_rgb)))


def _views_of(newcomer: Newcomer, shape: tuple[int, ...]) -> list[View]:
    """Return views of the end of what came in, where a hand would be, and of all of it."""
    near = float(np.clip(0.7 * newcomer.length, 0.25 * shape[1], 0.4 * shape[1]))
    inward = newcomer.tip + 0.15 * (newcomer.center - newcomer.tip)
    return [
        around(inward, near, shape),
        around(inward, near, shape, 2),
        around(inward, 1.5 * near, shape),
        around(inward, 1.5 * near, shape, 1),
        around(newcomer.center, 1.3 * newcomer.length, shape, 2),
        around(inward, near, shape, 3),
        whole(shape, contrast=True),
    ]


def _middle(hand: RawHand) -> np.ndarray:
    return np.asarray(hand.landmarks[:, :2].mean(axis=0))


def _same(a: RawHand, b: RawHand) -> bool:
    """Whether two looks see the same hand in the same shape."""
    difference = np.linalg.norm(a.landmarks[:, :2] - b.landmarks[:, :2], axis=1)
    size = max(a.size_px, b.size_px)
    return bool(np.median(difference) < _AGREEMENT * size and difference[INDEX_TIP] < _AGREEMENT * size)


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
