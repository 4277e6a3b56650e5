# SPDX-License-Identifier: Apache-2.0
"""Choice of the hand detector and of the pointing styles by name."""

from __future__ import annotations

from uncom_perception.config import GestureConfig
from uncom_perception.exceptions import UnknownBackendError
from uncom_perception.hands.gesture import STYLES, GestureReader, make_reader
from uncom_perception.hands.mediapipe_hands import MediaPipeHands

HAND_BACKENDS = ("mediapipe",)


def make_gesture_reader(config: GestureConfig) -> GestureReader:
    """Make what the configuration asks for.

    Raises:
        UnknownBackendError: a back end or a style that there is not.
        BackendUnavailableError: the back end cannot load.
    """
    if config.backend not in HAND_BACKENDS:
        raise UnknownBackendError("hand", config.backend, HAND_BACKENDS)
    for style in config.styles:
        if style not in STYLES:
            raise UnknownBackendError("pointing style", style, STYLES)
    full = MediaPipeHands(min_detection_confidence=config.min_detection_confidence)
    lite = MediaPipeHands(min_detection_confidence=config.min_detection_confidence, lite=True)
    return make_reader(full, lite, [STYLES[name]() for name in config.styles], config.min_evidence, config.keep_s)
