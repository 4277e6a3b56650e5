# SPDX-License-Identifier: Apache-2.0
"""The real MediaPipe on rendered pictures of a pointing person."""

from __future__ import annotations

import json

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, takes
from uncom_common.transforms import apply, invert
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.hands import hands_to_json, point_in_image
from uncom_perception.hands.detection.image_noise import noise_level, without_noise

SCENE = {
    "objects": [
        {"id": "lemon", "kind": "lemon", "x": 0.6, "y": 0.05},
        {"id": "bowl", "kind": "bowl", "colour": "red", "x": 0.62, "y": -0.22},
    ],
    "say": "take this lemon and put it in this bowl",
    "point_object": "lemon",
    "point_target": "bowl",
}


@pytest.fixture(scope="module")
def pictures():
    return [take for seed in (1, 2) for take in takes(SCENE, seed, (None, "object", "target"))]


@pytest.fixture(scope="module")
def frames(pictures):
    return [point_in_image(p.rgb, p.depth, CAMERA) for p in pictures]


def test_no_hand_is_seen_where_there_is_none(pictures, frames):
    """Without a person in the picture there are no hands and no pointing hand."""
    for picture, frame in zip(pictures, frames, strict=True):
        if picture.joints is None:
            assert frame.hands == ()
            assert frame.pointing_hand is None


def test_a_pointing_hand_points_where_its_finger_does(pictures, frames):
    """In the image the ray follows the finger within 10 degrees, in space within 15."""
    seen = 0
    for picture, frame in zip(pictures, frames, strict=True):
        if picture.joints is None or frame.pointing_hand is None:
            continue
        seen += 1
        ray = frame.hands[frame.pointing_hand].ray
        joints = apply(invert(POSE), picture.joints)
        pixels = CAMERA.project(joints)
        finger = (pixels[8] - pixels[5]) / np.linalg.norm(pixels[8] - pixels[5])
        assert np.degrees(np.arccos(np.clip(finger @ np.array(ray.direction), -1, 1))) < 10.0
        assert ray.metric is not None
        axis = (joints[8] - joints[5]) / np.linalg.norm(joints[8] - joints[5])
        error = np.degrees(np.arccos(np.clip(axis @ ray.metric.direction, -1, 1)))
        assert error < 15.0
        assert 1.0 < np.degrees(ray.sigma_rad) < 20.0
        assert np.linalg.norm(ray.metric.tip - joints[8]) < 0.03
    assert seen >= 3


@pytest.mark.parametrize("light", [0.2, 0.5])
def test_a_hand_points_in_dim_light_as_in_usual_light(pictures, frames, light):
    """A picture is looked at as if it were well lit, so that its ray hardly moves."""
    for picture, frame in zip(pictures, frames, strict=True):
        dim = point_in_image((picture.rgb * light).astype(np.uint8), picture.depth, CAMERA)
        assert (dim.pointing_hand is None) == (frame.pointing_hand is None)
        if dim.pointing_hand is not None:
            rays = [f.hands[f.pointing_hand].ray for f in (dim, frame)]
            assert np.degrees(np.arccos(np.clip(np.dot(rays[0].direction, rays[1].direction), -1, 1))) < 6.0


@pytest.mark.parametrize("level", [12.0, 25.0])
def test_a_hand_is_found_in_a_noisy_picture(pictures, frames, level):
    """Where a person still sees it at once; the palm detector alone finds none at either level."""
    for k, (picture, frame) in enumerate(zip(pictures, frames, strict=True)):
        if frame.pointing_hand is None:
            continue
        grain = np.random.default_rng(9100 + k).normal(0.0, level, picture.rgb.shape)
        noisy = point_in_image(np.clip(picture.rgb + grain, 0, 255).astype(np.uint8), picture.depth, CAMERA)
        assert noisy.pointing_hand is not None
        rays = [f.hands[f.pointing_hand].ray for f in (noisy, frame)]
        assert np.degrees(np.arccos(np.clip(np.dot(rays[0].direction, rays[1].direction), -1, 1))) < 15.0


def test_texture_is_no_noise():
    """A picture half of which is grass stays as it is; with noise all over, its level is told within a quarter."""
    rng = np.random.default_rng(9100)
    picture = np.full((480, 640, 3), 140, np.uint8)
    picture[240:] = rng.integers(60, 200, (240, 640, 3))
    assert without_noise(picture) is picture
    plain = np.full((480, 640, 3), 120.0)
    assert noise_level((plain + rng.normal(0.0, 12.0, plain.shape)).astype(np.uint8)) == pytest.approx(12.0, rel=0.25)


def test_the_json_holds_what_the_command_line_promises(frames):
    """Each hand has 21 landmarks of three numbers, and a ray exactly if it points."""
    for frame in frames:
        data = json.loads(json.dumps(hands_to_json(frame)))
        assert set(data) == {"hands", "pointing_hand"}
        for hand in data["hands"]:
            assert set(hand) == {"handedness", "score", "landmarks", "pointing", "ray"}
            assert np.shape(hand["landmarks"]) == (21, 3)
            assert (hand["ray"] is not None) == hand["pointing"]
            assert hand["handedness"] in ("left", "right")


def test_what_is_no_picture_is_refused():
    """A grey image is refused with its shape."""
    with pytest.raises(InvalidImageError, match=r"\(48, 64\)"):
        point_in_image(np.zeros((48, 64), np.uint8))
