# SPDX-License-Identifier: Apache-2.0
"""Pointing in one picture, for the command line."""

from __future__ import annotations

import functools
from typing import Any

from uncom_common.camera import PinholeCamera

from uncom_perception.hands.detection.mediapipe_hands import MediaPipeHands
from uncom_perception.hands.gesture_reader import make_reader
from uncom_perception.hands.pointing_rays import DepthImage
from uncom_perception.image_arrays import RgbImage
from uncom_perception.types import HandsFrame


@functools.cache
def _detectors() -> tuple[MediaPipeHands, MediaPipeHands]:
    return MediaPipeHands(), MediaPipeHands(lite=True)


def point_in_image(
    image_rgb: RgbImage, depth: DepthImage | None = None, camera: PinholeCamera | None = None
) -> HandsFrame:
    """Find hands and pointing rays in one picture (H, W, 3) uint8; depth (H, W) [m] makes the rays metric.

    Raises:
        InvalidImageError: not an RGB image.
        BackendUnavailableError: MediaPipe or its models are missing.
    """
    full, lite = _detectors()
    return make_reader(full, lite).read(image_rgb, 0.0, "", depth, camera, thorough=True)


def hands_to_json(frame: HandsFrame) -> dict[str, Any]:
    """Return what `uncom point --json` prints."""
    hands = []
    for hand in frame.hands:
        ray = hand.ray
        hands.append(
            {
                "handedness": hand.handedness,
                "score": round(hand.score, 4),
                "landmarks": [[round(float(c), 2) for c in mark] for mark in hand.landmarks],
                "pointing": hand.pointing,
                "ray": None
                if ray is None
                else {
                    "origin": [round(c, 2) for c in ray.origin],
                    "tip": [round(c, 2) for c in ray.tip],
                    "direction": [round(c, 5) for c in ray.direction],
                },
            }
        )
    return {"hands": hands, "pointing_hand": frame.pointing_hand}
