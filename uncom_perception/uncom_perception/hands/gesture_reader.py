# SPDX-License-Identifier: Apache-2.0
"""From an image to its hands, their rays, and the hand that points."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from uncom_common.camera import PinholeCamera

from uncom_perception.hands.detection.detector import HandDetector, RawHand
from uncom_perception.hands.detection.hand_finder import HandFinder
from uncom_perception.hands.finger_depth import on_its_finger
from uncom_perception.hands.options import HAND_SIZE, HandSizeOptions
from uncom_perception.hands.pointing_rays import DepthImage, hand_depth, image_ray, metric_ray
from uncom_perception.hands.styles.flat_hand import HandStyle
from uncom_perception.hands.styles.index import IndexStyle
from uncom_perception.hands.styles.style import PointingStyle, hand_pose
from uncom_perception.hands.styles.two_fingers import TwoFingersStyle
from uncom_perception.image_arrays import RgbImage
from uncom_perception.types import Hand, HandsFrame, PointingRay

STYLES: dict[str, type[PointingStyle]] = {style.name: style for style in (IndexStyle, TwoFingersStyle, HandStyle)}

#: Those that point wherever they are seen; an open palm points only where people are told that it does.
DEFAULT_STYLES = ("index", "two_fingers")


def pointing_evidence(styles: Sequence[PointingStyle], hand: RawHand) -> tuple[float, PointingStyle]:
    """Return the style that a hand shows best, and how sure that is, 0 to 1."""
    pose = hand_pose(hand)
    return max(((style.evidence(pose), style) for style in styles), key=lambda pair: pair[0])


def make_reader(
    full: HandDetector,
    lite: HandDetector | None = None,
    styles: Sequence[PointingStyle] = (),
    min_evidence: float = 0.4,
    keep_s: float = 0.7,
) -> GestureReader:
    """Put a finder and a reader together that use the same styles (DEFAULT_STYLES if none are given)."""
    chosen = tuple(styles) or tuple(STYLES[name]() for name in DEFAULT_STYLES)
    finder = HandFinder(full, lite=lite, evidence=lambda hand: pointing_evidence(chosen, hand)[0], keep_s=keep_s)
    return GestureReader(finder, chosen, min_evidence)


class GestureReader:
    """Reads the hands of a stream of images; keeps the last hands, so use one for each camera."""

    def __init__(
        self,
        finder: HandFinder,
        styles: Sequence[PointingStyle],
        min_evidence: float = 0.4,
        *,
        options: HandSizeOptions = HAND_SIZE,
    ) -> None:
        """Read with a finder; a hand points if the evidence for one of the styles is large enough."""
        self._options = options
        self._finder = finder
        self._styles = tuple(styles)
        self._min_evidence = min_evidence
        self._tips: dict[str, tuple[float, np.ndarray]] = {}

    @property
    def name(self) -> str:
        """Back end as told in every result."""
        return self._finder.name

    def expect(self, until_s: float) -> None:
        """Look closely at all images up to a time [s]: somebody speaks, and may point."""
        self._finder.expect(until_s)

    def read(
        self,
        image_rgb: RgbImage,
        stamp_s: float,
        frame_id: str = "",
        depth: DepthImage | None = None,
        camera: PinholeCamera | None = None,
        *,
        thorough: bool = False,
    ) -> HandsFrame:
        """Return the hands of an image (H, W, 3) uint8 with registered depth (H, W) [m] or without.

        Raises:
            InvalidImageError: not an RGB image.
        """
        start = time.perf_counter()
        raw = self._finder.find(image_rgb, stamp_s, thorough=thorough)
        if depth is not None and depth.shape != image_rgb.shape[:2]:
            depth = None
        hands: list[Hand] = []
        weights: list[float] = []
        for hand in raw:
            z = hand_depth(hand, depth) if depth is not None else 0.0
            if camera is not None and z > 0.0 and not _hand_sized(hand, z, camera, options=self._options):
                continue
            ray, evidence = self._ray(hand, depth, camera)
            hands.append(Hand(hand.handedness, hand.score, hand.landmarks, ray, z))
            weights.append(evidence * self._stillness(hand, stamp_s) * _nearness(hand, z) if ray is not None else 0.0)
        pointing = int(np.argmax(weights)) if weights and max(weights) > 0.0 else None
        height, width = image_rgb.shape[:2]
        latency = time.perf_counter() - start
        return HandsFrame(stamp_s, frame_id, width, height, tuple(hands), pointing, self.name, latency)

    def _ray(
        self, hand: RawHand, depth: DepthImage | None, camera: PinholeCamera | None
    ) -> tuple[PointingRay | None, float]:
        evidence, style = pointing_evidence(self._styles, hand)
        if evidence < self._min_evidence:
            return None, evidence
        if depth is not None and camera is not None:
            hand = on_its_finger(hand, style.line, depth, camera)
        ray = image_ray(hand, style.line, style.name)
        if ray is None or depth is None or camera is None:
            return ray, evidence
        found = metric_ray(hand, style.line, depth, camera)
        if found is None:
            return ray, evidence
        metric, sigma = found
        return PointingRay(ray.origin, ray.tip, ray.direction, sigma, metric, ray.style), evidence

    def _stillness(self, hand: RawHand, stamp_s: float) -> float:
        """Return how still the finger is, 1 for still, near 0 for a hand that sweeps through the image."""
        tip = hand.landmarks[8, :2]
        before = self._tips.get(hand.handedness)
        self._tips[hand.handedness] = (stamp_s, tip)
        if before is None or not 0.0 < stamp_s - before[0] < self._options.memory_s:
            return 0.7
        speed = float(np.linalg.norm(tip - before[1])) / hand.size_px / (stamp_s - before[0])  # hand sizes a second
        return float(1.0 / (1.0 + (speed / 2.0) ** 2))


def _nearness(hand: RawHand, depth_m: float) -> float:
    """Prefer the nearer hand: by metric depth, or else by size (never by MediaPipe's z, which starts at each wrist)."""
    return 1.0 / depth_m if depth_m > 0.0 else hand.size_px / 100.0


def _hand_sized(hand: RawHand, depth_m: float, camera: PinholeCamera, *, options: HandSizeOptions = HAND_SIZE) -> bool:
    span = float(np.linalg.norm(hand.landmarks[:, :2].max(axis=0) - hand.landmarks[:, :2].min(axis=0)))
    return options.least_palm_m < span * depth_m / camera.fx < 2.2 * options.greatest_palm_m
