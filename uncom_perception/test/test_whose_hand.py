# SPDX-License-Identifier: Apache-2.0
"""Of two hands the one that points."""

from __future__ import annotations

import numpy as np
import pytest
from test_pointing_geometry import CAMERA, hand
from uncom_perception.hands.detection.detector import HandDetector, RawHand
from uncom_perception.hands.gesture_reader import make_reader

PICTURE = np.full((480, 640, 3), 120, np.uint8)


class Told(HandDetector):
    """Sees the hands that it is told."""

    def __init__(self):
        self.hands = ()

    @property
    def name(self):
        return "told"

    def detect(self, image_rgb):
        return self.hands


def at(side, u, scale=1.0):
    """A pointing hand about a column of the picture, seen so much larger."""
    raw = hand(("index",))
    middle = np.array([320.0, 240.0, 0.0])
    marks = (raw.landmarks - middle) * scale + np.array([u, 240.0, 0.0])
    return RawHand(side, 0.9, marks, raw.world)


def read(frames, depth=None, reader=None):
    """Return the side of the hand that points in the last of some frames of hands, 0.1 s apart."""
    told = Told()
    reader = make_reader(told)
    for k, hands in enumerate(frames):
        told.hands = hands
        seen = reader.read(PICTURE, 1.0 + 0.1 * k, "", depth, CAMERA if depth is not None else None)
    return seen.hands[seen.pointing_hand].handedness


@pytest.mark.parametrize("near", ["left", "right"])
def test_of_two_hands_the_nearer_one_points(near):
    """By metric depth where there is any, whatever their sizes in the image; else the larger one."""
    far = "right" if near == "left" else "left"
    depth = np.full((480, 640), 1.1, np.float32)
    depth[:, : 320 if near == "left" else 640] = 0.7
    if near == "right":
        depth[:, :320] = 1.1
    places = {"left": 160.0, "right": 480.0}
    assert read([(at("left", 160.0), at("right", 480.0))], depth) == near
    assert read([(at(near, places[near], 1.2), at(far, places[far], 0.7))]) == near


@pytest.mark.parametrize("still", ["left", "right"])
def test_of_two_hands_the_still_one_points(still):
    """The other one sweeps through the image."""
    moving = "right" if still == "left" else "left"
    places = {"left": 160.0, "right": 400.0}
    frames = [(at(still, places[still]), at(moving, places[moving] + 30.0 * k)) for k in range(4)]
    assert read(frames) == still
