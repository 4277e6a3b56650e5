# SPDX-License-Identifier: Apache-2.0
"""Hands made of numbers: which shapes point, and rays from depth with holes and edges."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uncom_common.camera import PinholeCamera
from uncom_perception.hands.detection.detector import RawHand
from uncom_perception.hands.detection.image_views import View, around
from uncom_perception.hands.detection.motion_detection import MotionWatch
from uncom_perception.hands.finger_depth import on_its_finger
from uncom_perception.hands.pointing_rays import hand_depth, image_ray, metric_ray
from uncom_perception.hands.styles.index import IndexStyle
from uncom_perception.hands.styles.style import hand_pose
from uncom_perception.hands.styles.two_fingers import TwoFingersStyle

CAMERA = PinholeCamera(640, 480, 522.19, 522.19, 320.5, 240.5)
BONES = {"index": (0.04, 0.025, 0.02), "middle": (0.045, 0.028, 0.02), "ring": (0.04, 0.026, 0.02)}
BASES = {"index": 0.025, "middle": 0.005, "ring": -0.015, "little": -0.033}


def hand(extended, spread=0.0):
    """A hand flat before the camera, fingers along -y (up in the image); others are curled by 3 x 80 degrees."""
    world = np.zeros((21, 3))
    world[1:5] = [[0.03, -0.02, 0], [0.05, -0.04, 0], [0.05, -0.06, 0.01], [0.04, -0.075, 0.01]]
    for k, (name, x) in enumerate(BASES.items()):
        first = 5 + 4 * k
        lengths = BONES.get(name, (0.032, 0.02, 0.018))
        point, angle = np.array([x, -0.09, 0.0]), 0.0
        side = spread * (1 if name == "index" else -1 if name == "middle" else 0) / 2.0
        world[first] = point
        for bone, length in enumerate(lengths):
            angle += 0.0 if name in extended else np.radians(80.0)
            point = point + length * np.array([np.sin(side), -np.cos(angle) * np.cos(side), -np.sin(angle)])
            world[first + bone + 1] = point
    world = world - world.mean(axis=0)
    pixels = np.column_stack([320 + 900 * world[:, 0], 240 + 900 * world[:, 1], 900 * world[:, 2]])
    return RawHand("right", 0.9, pixels, world)


@pytest.mark.parametrize(
    ("extended", "spread", "points"),
    [
        (("index",), 0.0, True),
        ((), 0.0, False),
        (("index", "middle", "ring", "little"), 0.1, False),
        (("index", "middle"), 0.5, False),
        (("index", "middle"), 0.18, False),
        (("middle",), 0.0, False),
    ],
)
def test_only_a_pointing_shape_points(extended, spread, points):
    """Index out and the rest curled points; fist, open palm, a V, narrow or wide, and a middle finger do not."""
    pose = hand_pose(hand(extended, spread))
    evidence = max(IndexStyle().evidence(pose), TwoFingersStyle().evidence(pose))
    assert (evidence > 0.5) == points


def test_a_v_that_is_seen_in_the_image_is_no_pointing_although_its_depth_is_misjudged():
    """Landmarks in space may close a V; those in the image show it."""
    seen, misjudged = hand(("index", "middle"), 0.5), hand(("index", "middle"), 0.05)
    pose = hand_pose(RawHand("right", 0.9, seen.landmarks, misjudged.world))
    assert max(IndexStyle().evidence(pose), TwoFingersStyle().evidence(pose)) < 0.1


def test_two_fingers_together_point_in_their_own_style():
    """Index and middle finger side by side are the style two_fingers."""
    pose = hand_pose(hand(("index", "middle"), 0.02))
    assert TwoFingersStyle().evidence(pose) > 0.5
    assert TwoFingersStyle().evidence(pose) > IndexStyle().evidence(pose)


def finger_scene(direction, holes, seed):
    """Depth of a finger (8 mm thick half) from a base along a direction, over a background, and its raw hand."""
    rng = np.random.default_rng(seed)
    base = np.array([0.02, -0.05, 0.8])
    along = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    joints = base + np.array([0.0, 0.04, 0.066, 0.09])[:, None] * along
    raw = hand(("index",))
    marks = raw.landmarks.copy()
    marks[5:9, :2] = CAMERA.project(joints)
    depth = np.full((480, 640), 1.2, np.float32)
    for share in np.linspace(-0.05, 1.05, 40):
        center = base + share * 0.09 * along
        u, v = CAMERA.project(center)[0]
        radius = max(1, round(0.008 / center[2] * CAMERA.fx))
        near = cv2.circle(np.full_like(depth, 9.0), (round(u), round(v)), radius, center[2] - 0.008, -1)
        depth = np.minimum(depth, near)
    depth += rng.normal(0.0, 0.0015, depth.shape).astype(np.float32)
    depth[rng.random(depth.shape) < holes] = np.nan
    return RawHand("right", 0.9, marks, raw.world), depth, along, joints


@settings(max_examples=12, deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.8, 0.8), st.floats(0.0, 0.4), st.integers(0, 1000))
def test_the_metric_ray_survives_holes_and_background(x, y, z, holes, seed):
    """With up to 40 % of the depth missing the ray is right within four of its own standard deviations."""
    if np.hypot(x, y) < 0.35:
        x = 0.5
    raw, depth, along, joints = finger_scene((x, y, z), holes, seed)
    found = metric_ray(raw, (5, 6, 7, 8), depth, CAMERA)
    if found is None:  # refused is allowed, wrong is not
        return
    ray, sigma = found
    assert np.arccos(np.clip(ray.direction @ along, -1.0, 1.0)) < max(4.0 * sigma, 0.2)
    assert np.linalg.norm(ray.tip - joints[3]) < 0.03


def test_a_finger_whose_base_is_misjudged_is_found_by_its_own_pixels():
    """A hand taken for its mirror image has the index base beside the finger; the depth of the finger tells."""
    rng = np.random.default_rng(5)
    found = 0
    for seed in range(40):
        turn, side = rng.uniform(-0.7, 0.7), rng.choice([-1.0, 1.0])
        raw, depth, along, joints = finger_scene((np.sin(turn), np.cos(turn), 0.2), 0.1 * rng.random(), seed)
        marks = raw.landmarks.copy()
        shift = 0.3 * np.linalg.norm(marks[8, :2] - marks[5, :2]) * np.array([1.0, 0.4, 0.15, 0.0])
        marks[5:9, :2] += shift[:, None] * np.array([np.cos(turn), -np.sin(turn)]) * side
        wrong = RawHand("right", 0.9, marks, raw.world)
        ray = metric_ray(on_its_finger(wrong, (5, 6, 7, 8), depth, CAMERA), (5, 6, 7, 8), depth, CAMERA)
        if ray is None:  # refused is allowed now and then, wrong is not
            continue
        found += 1
        assert np.degrees(np.arccos(np.clip(ray[0].direction @ along, -1.0, 1.0))) < 6.0
        assert np.linalg.norm(ray[0].tip - joints[3]) < 0.03
    assert found >= 36


@pytest.mark.parametrize("seed", range(4))
def test_a_finger_that_is_judged_rightly_stays_and_none_is_made_up(seed):
    """Landmarks on the finger are kept; so are those where the depth shows no finger."""
    raw, depth, _, _ = finger_scene((0.3, 1.0, 0.1), 0.1, seed)
    assert on_its_finger(raw, (5, 6, 7, 8), depth, CAMERA) is raw
    flat = np.full_like(depth, 0.8) + np.random.default_rng(seed).normal(0.0, 0.002, depth.shape).astype(np.float32)
    assert on_its_finger(raw, (5, 6, 7, 8), flat, CAMERA) is raw
    assert on_its_finger(raw, (5, 6, 7, 8), np.full_like(depth, np.nan), CAMERA) is raw


def test_no_depth_no_metric_ray():
    """Where depth is missing on the finger there is no metric ray, and no depth of the hand."""
    raw, depth, _, _ = finger_scene((1.0, 0.2, 0.1), 0.0, 1)
    empty = np.full_like(depth, np.nan)
    assert metric_ray(raw, (5, 6, 7, 8), empty, CAMERA) is None
    assert hand_depth(raw, empty) == 0.0


def test_a_finger_without_length_has_no_ray():
    """A finger that looks straight into the camera has no direction in the image."""
    raw = hand(("index",))
    marks = raw.landmarks.copy()
    marks[5:9, :2] = marks[5, :2]
    assert image_ray(RawHand("right", 0.9, marks, raw.world), (5, 6, 7, 8), "index") is None


@given(st.integers(0, 3), st.floats(1.0, 3.0), st.integers(0, 100), st.integers(0, 100), st.sampled_from([0, 45]))
@settings(max_examples=30, deadline=None)
def test_views_find_their_way_back(turns, scale, x, y, margin):
    """A landmark seen in a turned, scaled crop with a margin lies where it was in the whole image."""
    view = View(x, y, 200, 120, turns, scale, margin=margin)
    point = np.array([x + 37.0, y + 81.0])
    image = np.zeros((300, 400, 3), np.uint8)
    image[y + 81, x + 37] = 255
    cut = View(x, y, 200, 120, turns, margin=margin).cut(image)
    v, u = np.argwhere(cut[..., 0] == 255)[0]
    marks = np.tile([(u + 0.5) * scale, (v + 0.5) * scale, 0.0], (21, 1))
    back = view.back(RawHand("left", 1.0, marks, np.zeros((21, 3))))
    assert back.landmarks[0, :2] == pytest.approx(point + 0.5, abs=1e-6)
    assert around((0, 0), 100, image.shape).x_min == 0


def test_what_comes_in_is_noticed_and_its_tip_found():
    """An arm that reaches in from the left has its tip at its right end; the same picture again has none."""
    rng = np.random.default_rng(3)
    picture = (120 + rng.normal(0, 2, (480, 640, 3))).astype(np.uint8)
    watch = MotionWatch()
    assert watch.changed(picture) is None
    assert watch.changed(picture) is None
    arm = picture.copy()
    arm[200:260, :300] = (220, 170, 140)
    newcomer = watch.changed(arm)
    assert newcomer is not None
    assert newcomer.tip[0] > 250
    assert abs(newcomer.tip[1] - 230) < 25
