# SPDX-License-Identifier: Apache-2.0
"""What the reasoner has seen lately: images, hands and the camera's place, and what of it a command needs.

Images are kept as they come (of whatever type) and handed back for the detector; only their stamps matter here.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np
from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import TransformError
from uncom_common.transforms import FloatArray, TransformBuffer
from uncom_language.types import Command
from uncom_perception.types import HandsFrame

from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.evidence.frame_buffer import SceneFrame, StampedBuffer, scene_frame
from uncom_reasoner.evidence.grounding_job import hands_until, object_end, words_span
from uncom_reasoner.pointing.ray_fusion import observe
from uncom_reasoner.types import RayObservation
from uncom_reasoner.weights import Weights

logger = logging.getLogger(__name__)

SAME_FRAME_S = 0.05
AHEAD_S = 4.0  # a frame so long before the words still shows what is spoken of
GESTURE_MARGIN_S = 2.0  # hands so long before and after the words are looked at


@dataclass(frozen=True, slots=True)
class SeenHands:
    """The hands of one image as values and as the message that they came in."""

    frame: HandsFrame
    message: Any


class Senses:
    """Bounded memory of the senses. Thread safe."""

    def __init__(self, config: ReasonerConfig) -> None:
        """Start empty."""
        self._config = config
        self.images: StampedBuffer[Any] = StampedBuffer(config.buffer_s, config.buffer_hz)
        self.depths: StampedBuffer[Any] = StampedBuffer(config.buffer_s, config.buffer_hz)
        self.hands: StampedBuffer[SeenHands] = StampedBuffer(config.hands_keep_s)
        self.transforms = TransformBuffer(keep_s=config.hands_keep_s)
        self.camera_info: Any = None
        self.camera: PinholeCamera | None = None
        self.camera_frame = ""
        self.ahead_s: float | None = None

    def latest_s(self) -> float:
        """Return up to when both images and hands are known."""
        return min(self.hands.latest_s(), self.images.latest_s())

    def look_ahead(self, now_s: float) -> float | None:
        """Choose a frame without a hand to detect things in before the command is known; None if there is none."""
        config = self._config
        hands = [(stamp, bool(seen.frame.hands)) for stamp, seen in self.hands.items()]
        choice = scene_frame(self._stamps(), hands, now_s, config.hand_free_before_s, config.hand_free_after_s)
        if choice is None or choice.with_hand or choice.stamp_s < now_s - AHEAD_S:
            return None
        self.ahead_s = choice.stamp_s
        return choice.stamp_s

    def _stamps(self) -> list[float]:
        """Return the stamps of the images, of those with depth if there are any."""
        stamps = [stamp for stamp, _ in self.images.items()]
        return [stamp for stamp in stamps if self.depth_at(stamp) is not None] or stamps

    def rays_between(self, start_s: float, end_s: float) -> tuple[RayObservation, ...]:
        """Return the rays of a stretch of time, in the base frame."""
        near = [seen.frame for stamp, seen in self.hands.items() if start_s <= stamp <= end_s]
        return observe(near, self.camera_in_base)

    def look_until(self, command: Command) -> float | None:
        """Return the time [s] up to which hands and images choose the image to look at; None: not yet known."""
        needed = words_span(command).end_s - self._config.behind_s
        if self.images.latest_s() < needed:
            return None
        return next((stamp for stamp, _ in self.hands.items() if stamp >= needed), None)

    def hands_until(self, command: Command, weights: Weights) -> float | None:
        """Return the time [s] of the image whose hands complete what a command needs (job.hands_until)."""
        stamps = [stamp for stamp, _ in self.hands.items()]
        rays = self.rays(command, np.eye(4))
        return hands_until(command, stamps, rays, self._config.late_pointing_s, weights)

    def scene_frame(self, command: Command, until_s: float = float("inf")) -> SceneFrame | None:
        """Choose the image whose things are weighed for a command, or None without images.

        Images and hands after until_s [s] are left out, so that the choice does not depend on when it is made. A frame
        that was looked at ahead is taken if it still shows no hand: what was found in it is known.
        """
        end = words_span(command).end_s
        last = min(end + 5.0, until_s)
        hands = [(stamp, bool(seen.frame.hands)) for stamp, seen in self.hands.items() if stamp <= last]
        config = self._config
        wanted = object_end(command)
        spans = (config.hand_free_before_s, config.hand_free_after_s)
        if self.ahead_s is not None and wanted - AHEAD_S <= self.ahead_s <= wanted:
            known = scene_frame([self.ahead_s], hands, wanted, *spans)
            if known is not None and not known.with_hand and self.image_at(known.stamp_s) is not None:
                return known
        stamps = self._stamps()
        return scene_frame([s for s in stamps if s <= until_s] or stamps, hands, wanted, *spans)

    def image_at(self, stamp_s: float) -> Any | None:
        """Return the image with a stamp, or None if it is gone."""
        found = self.images.nearest(stamp_s, SAME_FRAME_S)
        return found[1] if found is not None else None

    def depth_at(self, stamp_s: float) -> Any | None:
        """Return the depth image with a stamp, or None."""
        found = self.depths.nearest(stamp_s, SAME_FRAME_S)
        return found[1] if found is not None else None

    def hands_at(self, stamp_s: float) -> Any | None:
        """Return the hands' message of an image, or None."""
        found = self.hands.nearest(stamp_s, SAME_FRAME_S)
        return found[1].message if found is not None else None

    def nearest_image_s(self, stamp_s: float) -> float:
        """Return the stamp of the image nearest to a time, or the time itself without images."""
        found = self.images.nearest(stamp_s)
        return found[0] if found is not None else stamp_s

    def camera_in_base(self, stamp_s: float) -> FloatArray | None:
        """Return transform_camera_to_base (4, 4) at a time, or None if it is not known."""
        if not self.camera_frame:
            return None
        try:
            return self.transforms.lookup(self.camera_frame, self._config.base_frame, stamp_s)
        except TransformError as error:
            logger.debug("%s", error)
            return None

    def rays(
        self, command: Command, fixed: FloatArray | None, until_s: float = float("inf")
    ) -> tuple[RayObservation, ...]:
        """Return the rays around a command's words.

        Args:
            command: with its times.
            fixed: transform_camera_to_scene (4, 4) if the scene is in the camera's frame; None: the scene is in the
                base frame and each image's own transform counts.
            until_s: later hands are left out [s].
        """
        span = words_span(command)
        near = [
            seen.frame
            for stamp, seen in self.hands.items()
            if span.start_s - GESTURE_MARGIN_S <= stamp <= min(span.end_s + GESTURE_MARGIN_S, until_s)
        ]
        return observe(near, self.camera_in_base if fixed is None else lambda _: fixed)
