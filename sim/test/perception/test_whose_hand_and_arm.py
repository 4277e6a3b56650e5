# SPDX-License-Identifier: Apache-2.0
"""Of two hands the one that points; arms that reach over the table are no things."""

from __future__ import annotations

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, overlap, plain_table
from test_pointing_geometry import hand
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.hands.detector import HandDetector, RawHand
from uncom_perception.hands.gesture import make_reader
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.segmentation.cluster import ClusterSegmenter
from uncom_perception.types import Box

PICTURE = np.full((480, 640, 3), 120, np.uint8)
BLOCK = (0.65, 0.0, 0.1, 0.1, 0.1, (200, 30, 30))


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


def test_an_arm_that_reaches_over_the_table_is_no_thing():
    """From the robot's side, as its own, or from the far side, as a sleeved one; what it reaches over is found."""
    for x, length in ((0.3, 0.9), (1.0, 0.7)):
        rgb, depth = plain_table(blocks=[BLOCK], seed=9100)
        truth = np.all(rgb == BLOCK[-1], axis=2)
        v, u = np.mgrid[0:480, 0:640]
        rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
        rays = rays @ POSE[:3, :3].T
        low = np.array([x - length / 2, 0.2, 0.9]) - POSE[:3, 3]
        high = np.array([x + length / 2, 0.29, 0.98]) - POSE[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = low / rays, high / rays
        near, away = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
        arm = (near < away) & (near > 0) & (near < depth)
        depth[arm], rgb[arm] = near[arm].astype(np.float32), (90, 90, 95)
        scene = TabletopDetector().detect(rgb, depth, CAMERA, POSE, [])
        assert arm.sum() > 3000
        assert len(scene.detections) == 1
        assert overlap(scene.detections[0].mask, truth) > 0.8


def test_without_depth_grabcut_gives_the_thing_at_a_point_or_in_a_box():
    """It is the default where there is no model with weights."""
    rgb, _ = plain_table(blocks=[BLOCK])
    truth = np.all(rgb == BLOCK[-1], axis=2)
    v, u = np.nonzero(truth)
    box = Box(float(u.min() - 6), float(v.min() - 6), float(u.max() + 6), float(v.max() + 6))
    masks, scores = ClusterSegmenter().segment(rgb, None, np.array([[u.mean(), v.mean()]]), [box])
    for mask, score in zip(masks, scores, strict=True):
        assert overlap(mask, truth) > 0.8
        assert score > 0.3
    with pytest.raises(InvalidImageError, match="outside"):
        ClusterSegmenter().segment(rgb, None, np.array([[900.0, 10.0]]), [])
