# SPDX-License-Identifier: Apache-2.0
"""Images, hands and camera poses of the last seconds, and which of them a command needs.

Images are kept as they come (of whatever type) and handed back for the detector; only their stamps matter here.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import TransformError
from uncom_common.transforms import FloatArray, TransformBuffer
from uncom_language.types import Command
from uncom_perception.types import HandsFrame

from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.evidence.frame_buffer import SceneFrame, StampedBuffer, choose_scene_frame
from uncom_reasoner.evidence.gesture_timing import gestures_complete_at_s, object_end_s, words_span
from uncom_reasoner.evidence.options import GESTURE_TIMING, SENSOR_MEMORY, GestureTimingOptions, SensorMemoryOptions
from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.weights import Weights

logger = logging.getLogger(__name__)


class SensorMemory:
    """Bounded memory of images, hands and transforms. Thread safe.

    Attributes:
        images: colour images, opaque; `depths`: the depth images registered to them, opaque.
        hands: the hands of every image in which hands were looked for.
        transforms: of the robot's frames.
        camera: intrinsics of the images, None until they are known.
        camera_frame: frame of the images, "" until it is known.
        base_frame: frame of grounded commands.
    """

    def __init__(
        self,
        config: ReasonerConfig,
        options: SensorMemoryOptions = SENSOR_MEMORY,
        gesture_timing: GestureTimingOptions = GESTURE_TIMING,
    ) -> None:
        """Start empty.

        Args:
            config: how long and how densely images and hands are kept, and when a frame counts as free of hands.
            options: which images and hands belong together.
            gesture_timing: when the hands that were seen are enough.
        """
        self._config, self._options, self._gesture_timing = config, options, gesture_timing
        self.images: StampedBuffer[Any] = StampedBuffer(config.buffer_s, config.buffer_hz, options)
        self.depths: StampedBuffer[Any] = StampedBuffer(config.buffer_s, config.buffer_hz, options)
        self.hands: StampedBuffer[HandsFrame] = StampedBuffer(config.hands_keep_s, options=options)
        self.transforms = TransformBuffer(keep_s=config.hands_keep_s)
        self.camera: PinholeCamera | None = None
        self.camera_frame = ""
        self.base_frame = config.base_frame
        self._ahead_s: float | None = None  # stamp of the frame that was chosen ahead of a command

    def choose_frame_ahead(self, now_s: float) -> SceneFrame | None:
        """Choose a frame without a hand to detect objects in before the command is known; None if there is none."""
        config = self._config
        hands = [(stamp_s, bool(frame.hands)) for stamp_s, frame in self.hands.items()]
        choice = choose_scene_frame(self._frames_s(), hands, now_s, config.hand_free_before_s, config.hand_free_after_s)
        if choice is None or choice.with_hand or choice.stamp_s < now_s - self._options.ahead_age_s:
            return None
        self._ahead_s = choice.stamp_s
        return choice

    def _frames_s(self) -> list[float]:
        """Return the stamps [s] of the images, of those with depth if there are any."""
        stamps_s = [stamp_s for stamp_s, _ in self.images.items()]
        return [stamp_s for stamp_s in stamps_s if self.depth_at(stamp_s) is not None] or stamps_s

    def rays_between(self, start_s: float, end_s: float) -> tuple[RayObservation, ...]:
        """Return the rays of the hands seen in a stretch of time [s], in the base frame."""
        frames = [frame for stamp_s, frame in self.hands.items() if start_s <= stamp_s <= end_s]
        return observe_rays(frames, self.camera_in_base)

    def frame_choice_until_s(self, command: Command) -> float | None:
        """Return the time [s] up to which hands and images choose the frame to look at; None: not yet known."""
        needed_s = words_span(command).end_s - self._config.behind_s
        if self.images.latest_s() < needed_s:
            return None
        return next((stamp_s for stamp_s, _ in self.hands.items() if stamp_s >= needed_s), None)

    def gestures_complete_at_s(self, command: Command, weights: Weights) -> float | None:
        """Return the time [s] of the image whose hands complete what a command needs; None: not yet seen."""
        return gestures_complete_at_s(
            command,
            [stamp_s for stamp_s, _ in self.hands.items()],
            self.rays(command, np.eye(4)),
            self._config.late_pointing_s,
            weights,
            self._gesture_timing,
        )

    def choose_frame(self, command: Command, until_s: float = float("inf")) -> SceneFrame | None:
        """Choose the frame in which the objects of a command are looked for, or None without images.

        Images and hands after until_s [s] are left out, so that the choice does not depend on when it is made. A frame
        that was chosen ahead is taken if it still shows no hand: what was found in it is known.
        """
        config = self._config
        last_s = min(words_span(command).end_s + self._options.hands_after_words_s, until_s)
        hands = [(stamp_s, bool(frame.hands)) for stamp_s, frame in self.hands.items() if stamp_s <= last_s]
        wanted_s = object_end_s(command)
        hand_free_s = (config.hand_free_before_s, config.hand_free_after_s)
        ahead_s = self._ahead_s
        if ahead_s is not None and wanted_s - self._options.ahead_age_s <= ahead_s <= wanted_s:
            ahead = choose_scene_frame([ahead_s], hands, wanted_s, *hand_free_s)
            if ahead is not None and not ahead.with_hand and self.image_at(ahead.stamp_s) is not None:
                return ahead
        frames_s = self._frames_s()
        return choose_scene_frame([s for s in frames_s if s <= until_s] or frames_s, hands, wanted_s, *hand_free_s)

    def image_at(self, stamp_s: float) -> Any | None:
        """Return the image with a stamp, or None if it is gone."""
        found = self.images.nearest(stamp_s, self._options.same_frame_s)
        return found[1] if found is not None else None

    def depth_at(self, stamp_s: float) -> Any | None:
        """Return the depth image with a stamp, or None."""
        found = self.depths.nearest(stamp_s, self._options.same_frame_s)
        return found[1] if found is not None else None

    def hands_at(self, stamp_s: float) -> HandsFrame | None:
        """Return the hands of an image, or None where they were not looked for."""
        found = self.hands.nearest(stamp_s, self._options.same_frame_s)
        return found[1] if found is not None else None

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
        margin_s = self._options.hands_margin_s
        frames = [
            frame
            for stamp_s, frame in self.hands.items()
            if span.start_s - margin_s <= stamp_s <= min(span.end_s + margin_s, until_s)
        ]
        return observe_rays(frames, self.camera_in_base if fixed is None else lambda _: fixed)
