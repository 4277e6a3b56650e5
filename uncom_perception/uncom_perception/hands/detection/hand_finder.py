# SPDX-License-Identifier: Apache-2.0
"""Finding hands, with second looks where the first one fails; every hand was seen by the detector, none is invented."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from uncom_perception.exposure import lightened
from uncom_perception.hands.detection.detector import HandDetector, RawHand
from uncom_perception.hands.detection.image_noise import without_noise
from uncom_perception.hands.detection.image_views import View, around, from_afar, second_looks, whole
from uncom_perception.hands.detection.landmarks import Landmark
from uncom_perception.hands.detection.motion_detection import MotionWatch, Newcomer
from uncom_perception.hands.detection.options import HAND_FINDER, HandFinderOptions
from uncom_perception.image_arrays import FloatArray, RgbImage, check_rgb


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
        options: HandFinderOptions = HAND_FINDER,
    ) -> None:
        """Look with a detector.

        Args:
            options: numbers that tune it.
            detector: the main one.
            lite: another one, which sees other hands.
            evidence: how clearly a hand points, 0 to 1; an unclear hand gets another look.
            keep_s: how long a hand is expected after it was last seen [s].
        """
        self._options = options
        self._detector = detector
        self._lite = lite
        self._evidence = evidence
        self._keep_s = keep_s
        self._watch = MotionWatch()
        self._last: tuple[RawHand, ...] = ()
        self._last_stamp_s = -np.inf
        self._turn = 0
        self._misses = 0
        self._stamp_s = self._looked_s = self._expected_until_s = -np.inf
        self._quiet_since_s = np.inf
        self._unclear: FloatArray = np.zeros(2)
        self._unclear_s = -np.inf

    @property
    def name(self) -> str:
        """Back end as told in every result."""
        return self._detector.name

    def expect(self, until_s: float) -> None:
        """Look closely at all images up to a time [s]: somebody speaks, and may point."""
        self._expected_until_s = until_s

    def find(self, image_rgb: RgbImage, stamp_s: float, *, thorough: bool = False) -> tuple[RawHand, ...]:
        """Return at most two hands of an image (H, W, 3) uint8, best first.

        Thorough is for single pictures: all second looks. In a stream they are taken where a hand was a moment ago,
        where something has come into the picture, and elsewhere by turns; a scene in which nothing has changed since
        it was seen without hands is looked at twice a second only.
        """
        check_rgb(image_rgb)
        if stamp_s < self._stamp_s:  # a bag was started again
            self._last_stamp_s = self._looked_s = self._quiet_since_s = -np.inf
        self._stamp_s = stamp_s
        newcomer = self._watch.changed(image_rgb)
        if not self._watch.quiet:
            self._quiet_since_s = np.inf
        self._quiet_since_s = min(self._quiet_since_s, stamp_s)
        attentive = thorough or stamp_s <= self._expected_until_s
        lost = bool(self._last) and 0.0 <= stamp_s - self._last_stamp_s <= self._keep_s
        quiet = self._watch.quiet and stamp_s - self._quiet_since_s >= self._options.settled_s
        if quiet and not attentive and not self._last and 0.0 <= stamp_s - self._looked_s < self._options.idle_period_s:
            return ()
        self._looked_s = stamp_s
        image_rgb = without_noise(lightened(image_rgb))
        hands = _plausible(self._detector.detect(image_rgb))
        if hands:
            hands = tuple(self._settled(image_rgb, hand, stamp_s) for hand in hands)
            self._misses = 0
        else:
            self._misses = 0 if attentive else self._misses + 1
            # Where the scene is again as it was before the hand came, the hand has left.
            looking = lost and not self._watch.quiet
            hands = self._look_again(image_rgb, newcomer, lost=looking, thorough=thorough)
        if hands:
            self._last, self._last_stamp_s = hands, stamp_s
        elif not lost or self._watch.quiet:
            self._last = ()
        return hands

    def _settled(self, image_rgb: RgbImage, hand: RawHand, stamp_s: float) -> RawHand:
        """Return a hand as two looks agree to see it, where the first one does not clearly see it pointing.

        A hand that did not point a moment ago is not looked at closely in every image.
        """
        if self._evidence is None or self._evidence(hand) >= self._options.clear_evidence:
            return hand
        near = np.linalg.norm(_middle(hand) - self._unclear) < 0.3 * hand.size_px
        if (
            near
            and 0.0 < stamp_s - self._unclear_s < self._options.closer_period_s
            and stamp_s > self._expected_until_s
        ):
            return hand
        clear: list[RawHand] = []
        for seen in self._closer_looks(image_rgb, hand):
            if np.linalg.norm(_middle(seen) - _middle(hand)) > 0.6 * max(hand.size_px, seen.size_px):
                continue
            if self._evidence(seen) < self._options.clear_evidence:
                continue
            if any(_same(seen, other, options=self._options) for other in clear) or _same(
                seen, hand, options=self._options
            ):
                return seen
            clear.append(seen)
        self._unclear, self._unclear_s = _middle(hand), stamp_s
        return hand

    def _closer_looks(self, image_rgb: RgbImage, hand: RawHand) -> Iterator[RawHand]:
        """Yield what both models see in the image and in cuts of it: where one fails, the other seldom does."""
        detectors = [self._detector] if self._lite is None else [self._lite, self._detector]
        if self._lite is not None:
            yield from _plausible(self._lite.detect(image_rgb))
        for factor, turns in ((3.5, 0), (2.4, 2), (3.5, 1)):
            view = around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns)
            for detector in detectors:
                yield from _plausible(_seen_in(image_rgb, view, detector))

    def _look_again(
        self, image_rgb: RgbImage, newcomer: Newcomer | None, *, lost: bool, thorough: bool
    ) -> tuple[RawHand, ...]:
        views: list[View] = []
        if lost:
            for hand in self._last:
                for factor, turns in ((2.6, 0), (2.6, 2), (4.0, 0)):
                    views.append(around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns))
        if newcomer is not None:
            views += _views_of(newcomer, image_rgb.shape)
        elsewhere = list(second_looks(image_rgb.shape))
        fresh = self._misses <= self._options.fresh_images
        if thorough:
            views += elsewhere
        elif not views:
            views = elsewhere
        if not thorough and not (fresh and (lost or newcomer is not None)):
            # What was looked at in vain a few times gets one look an image, by turns.
            self._turn += 1
            views = [views[self._turn % len(views)]]
        use_lite = thorough or (fresh and (lost or newcomer is not None))
        return self._agreed(image_rgb, views[: None if thorough else self._options.max_looks], use_lite=use_lite)

    def _agreed(self, image_rgb: RgbImage, views: Iterable[View], *, use_lite: bool) -> tuple[RawHand, ...]:
        """Return the first hand that two looks agree on."""
        seen: list[RawHand] = []

        def agree(hand: RawHand) -> RawHand | None:
            for other in seen:
                if _same(hand, other, options=self._options):
                    return max(hand, other, key=self._evidence or (lambda h: h.score))
            return None

        def looks() -> Iterator[RawHand]:
            if use_lite and self._lite is not None:
                for hand in _plausible(self._lite.detect(image_rgb)):
                    yield hand
                    yield from self._confirmations(image_rgb, hand)
            for view in views:
                for hand in _plausible(_seen_in(image_rgb, view, self._detector)):
                    yield hand
                    yield from self._confirmations(image_rgb, hand)

        for hand in looks():
            both = agree(hand)
            if both is not None:
                return (self._settled(image_rgb, both, self._stamp_s),)
            seen.append(hand)
        return ()

    def _confirmations(self, image_rgb: RgbImage, hand: RawHand) -> Iterator[RawHand]:
        for factor, turns in ((2.4, 0), (3.5, 0), (1.7, 0), (2.4, 2)):
            view = around(_middle(hand), factor * hand.size_px, image_rgb.shape, turns)
            yield from _plausible(_seen_in(image_rgb, view, self._detector))
        if hand.size_px > self._options.large_hand * min(image_rgb.shape[:2]):
            yield from _plausible(_seen_in(image_rgb, from_afar(image_rgb.shape, 0.55), self._detector))


def _seen_in(image_rgb: RgbImage, view: View, detector: HandDetector) -> tuple[RawHand, ...]:
    return tuple(view.back(hand) for hand in detector.detect(view.cut(image_rgb)))


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


def _same(a: RawHand, b: RawHand, *, options: HandFinderOptions = HAND_FINDER) -> bool:
    """Whether two looks see the same hand in the same shape."""
    difference = np.linalg.norm(a.landmarks[:, :2] - b.landmarks[:, :2], axis=1)
    size = max(a.size_px, b.size_px)
    return bool(
        np.median(difference) < options.agreement * size and difference[Landmark.INDEX_TIP] < options.agreement * size
    )


def _plausible(hands: tuple[RawHand, ...]) -> tuple[RawHand, ...]:
    """Drop what has no palm (degenerate landmarks) and the second of two that lie on one another."""
    kept: list[RawHand] = []
    for hand in hands:
        marks = hand.landmarks[:, :2]
        if hand.size_px < HAND_FINDER.least_size_px:
            continue
        palm = marks[[Landmark.WRIST, Landmark.INDEX_MCP, Landmark.MIDDLE_MCP, Landmark.PINKY_MCP]]
        if np.ptp(palm, axis=0).max() < 0.15 * hand.size_px:
            continue
        if any(np.median(np.linalg.norm(marks - k.landmarks[:, :2], axis=1)) < 0.3 * k.size_px for k in kept):
            continue
        kept.append(hand)
    return tuple(kept[:2])
