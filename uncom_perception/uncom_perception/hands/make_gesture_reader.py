# SPDX-License-Identifier: Apache-2.0
"""Choice of the hand detector and of the pointing styles by name."""

from __future__ import annotations

from uncom_perception.config import GestureConfig
from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.hands.detection.detector import HandDetector
from uncom_perception.hands.detection.mediapipe_hands import MediaPipeHands
from uncom_perception.hands.gesture_reader import STYLES, GestureReader, make_reader

HAND_BACKENDS = ("mediapipe",)


def load_hand_detectors(config: GestureConfig) -> tuple[HandDetector, HandDetector]:
    """Load the main detector and the lighter one that second looks use.

    They keep nothing from one image to the next, so several readers may follow one another on the same pair; a pair
    holds some 150 MB until the process ends.

    Raises:
        UnknownBackendError: a back end that there is not.
        BackendUnavailableError: the back end cannot load.
    """
    if config.backend not in HAND_BACKENDS:
        raise UnknownBackendError("hand", config.backend, HAND_BACKENDS)
    confidence = config.min_detection_confidence
    return (
        MediaPipeHands(min_detection_confidence=confidence),
        MediaPipeHands(min_detection_confidence=confidence, lite=True),
    )


def make_gesture_reader(
    config: GestureConfig, detectors: tuple[HandDetector, HandDetector] | None = None
) -> GestureReader:
    """Make what the configuration asks for, with detectors that are loaded already or new ones.

    Raises:
        UnknownBackendError: a back end or a style that there is not.
        BackendUnavailableError: the back end cannot load.
    """
    for style in config.styles:
        if style not in STYLES:
            raise UnknownBackendError("pointing style", style, STYLES)
    full, lite = detectors or load_hand_detectors(config)
    return make_reader(full, lite, [STYLES[name]() for name in config.styles], config.min_evidence, config.keep_s)
