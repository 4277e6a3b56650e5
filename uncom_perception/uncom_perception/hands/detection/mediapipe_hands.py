# SPDX-License-Identifier: Apache-2.0
"""MediaPipe hands with the models inside its wheel (paper, section III-E)."""

from __future__ import annotations

from importlib import metadata
from typing import Any

import numpy as np

from uncom_perception.exceptions import BackendUnavailableError
from uncom_perception.hands.detection.detector import HandDetector, RawHand
from uncom_perception.image_arrays import RgbImage, check_rgb


class MediaPipeHands(HandDetector):
    """MediaPipe's palm detector and landmark model, every image on its own.

    Its handedness assumes a mirrored (selfie) image; ours are not mirrored, so it is swapped here.
    """

    def __init__(self, *, min_detection_confidence: float = 0.3, lite: bool = False) -> None:
        """Load the full or the lite pair of models.

        Raises:
            BackendUnavailableError: this MediaPipe has no hand models in its wheel.
        """
        try:
            import mediapipe as mp  # noqa: PLC0415  (loading it takes a second)

            self._hands: Any = mp.solutions.hands.Hands(
                static_image_mode=True,
                max_num_hands=2,
                model_complexity=0 if lite else 1,
                min_detection_confidence=min_detection_confidence,
            )
            self._name = f"mediapipe {metadata.version('mediapipe')} ({'lite' if lite else 'full'})"
        except (ImportError, AttributeError, FileNotFoundError) as error:
            message = f"MediaPipe 0.10.21 with its hand models is needed: pip install mediapipe==0.10.21 ({error})"
            raise BackendUnavailableError(message) from error

    @property
    def name(self) -> str:
        """Version and model."""
        return self._name

    def detect(self, image_rgb: RgbImage) -> tuple[RawHand, ...]:
        """Return at most two hands, best first."""
        check_rgb(image_rgb)
        height, width = image_rgb.shape[:2]
        result = self._hands.process(np.ascontiguousarray(image_rgb))
        if not result.multi_hand_landmarks:
            return ()
        scale = np.array([width, height, width], dtype=float)
        hands = []
        for marks, world, sides in zip(
            result.multi_hand_landmarks, result.multi_hand_world_landmarks, result.multi_handedness, strict=True
        ):
            side = sides.classification[0]
            hands.append(
                RawHand(
                    handedness="left" if side.label == "Right" else "right",
                    score=float(side.score),
                    landmarks=np.array([[p.x, p.y, p.z] for p in marks.landmark]) * scale,
                    world=np.array([[p.x, p.y, p.z] for p in world.landmark]),
                )
            )
        return tuple(sorted(hands, key=lambda hand: -hand.score))
