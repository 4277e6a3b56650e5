# SPDX-License-Identifier: Apache-2.0
"""A recording as what a session sees: images, hands and transforms into its memory, and the detector on its images."""

from __future__ import annotations

from collections.abc import Sequence

from uncom_perception.exceptions import InvalidImageError
from uncom_perception.objects.scene_detector import SceneDetector, nearest_poses
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import HandsFrame, Scene
from uncom_reasoner.evidence.sensor_memory import SensorMemory
from uncom_reasoner.session.task import DetectionRequest
from uncom_reasoner.types import Evidence

from uncom_bringup.chain.config import ChainConfig
from uncom_bringup.chain.recording import Recording


class RecordingClock:
    """The clocks of a session on a recording: all of it has been seen, so that nothing is waited for."""

    def stamp_s(self) -> float:
        """Return a time after every stamp."""
        return float("inf")

    def steady_s(self) -> float:
        """Return a time that stands still: a recording has no pace."""
        return 0.0


class RecordingSource:
    """Plays a recording into a session's memory, and answers its requests to the detector."""

    def __init__(
        self,
        recording: Recording,
        hands: Sequence[HandsFrame],
        memory: SensorMemory,
        detector: SceneDetector,
        config: ChainConfig,
        known: Sequence[Evidence] = (),
    ) -> None:
        """Put camera and transforms into the memory; images and hands come with `play_until`.

        Args:
            recording: that is played.
            hands: of its images, in order of time.
            memory: that is filled.
            detector: finds the objects.
            config: of the nodes.
            known: of earlier decisions, whose scenes are used again.
        """
        self._recording, self._memory, self._detector, self._config = recording, memory, detector, config
        self._known = known
        self._frames, self._hands = iter(recording.frames()), list(hands)
        self._played_s = float("-inf")
        memory.camera, memory.camera_frame = recording.camera, recording.camera_frame
        for transform, static in recording.transforms:
            memory.transforms.add(transform, static=static)

    def play_until(self, until_s: float) -> None:
        """Remember what came up to the first image at or after a time [s]."""
        memory = self._memory
        while self._played_s < until_s:
            frame = next(self._frames, None)
            if frame is None:
                break
            self._played_s = frame.stamp_s
            memory.images.add(frame.stamp_s, frame.rgb)
            if frame.depth is not None and self._config.reasoner.use_depth:
                memory.depths.add(frame.stamp_s, frame.depth)
        latest_s = memory.images.latest_s()
        while self._hands and self._hands[0].stamp_s <= latest_s:
            hands = self._hands.pop(0)
            memory.hands.add(hands.stamp_s, hands)

    def detect(self, request: DetectionRequest) -> Scene:
        """Find the objects in an image, unless it was searched for the same phrases before.

        Raises:
            UncomError: the detector cannot work with the image.
        """
        stamp_s = request.frame.stamp_s
        for evidence in self._known:
            if evidence.scene.stamp_s == stamp_s and evidence.phrases == request.phrases:
                return evidence.scene
        rgb = self._memory.image_at(stamp_s)
        if rgb is None:
            raise InvalidImageError(f"there is no image of {stamp_s:.2f} s")
        image = RgbdFrame(
            rgb,
            self._memory.depth_at(stamp_s),
            self._recording.camera,
            self._memory.camera_in_base(stamp_s),
            self._recording.camera_frame,
            self._memory.base_frame,
            stamp_s,
        )
        hands = self._memory.hands_at(stamp_s) if request.frame.with_hand else None
        outside = nearest_poses(self._recording.object_poses, stamp_s, self._config.detection.model_age_s)
        return self._detector.detect(image, request.phrases, hands, outside)
