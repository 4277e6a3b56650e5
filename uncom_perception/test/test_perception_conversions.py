# SPDX-License-Identifier: Apache-2.0
"""Values of seeing survive the way through messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from uncom_perception.conversions import (
    detection_from_msg,
    detection_to_msg,
    hands_from_msg,
    hands_to_msg,
    mask_from_msg,
    mask_to_msg,
    scene_from_response,
    scene_to_response,
    table_from_msg,
    table_to_msg,
)
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.types import (
    Attribute,
    Box,
    Detection,
    Geometry,
    Hand,
    HandsFrame,
    MetricRay,
    PointingRay,
    Scene,
    TableSurface,
)


@given(arrays(bool, st.tuples(st.integers(1, 20), st.integers(1, 20))))
@settings(max_examples=60, deadline=None)
def test_any_mask_comes_back(mask):
    """Also one that starts with a one, or is all the same."""
    msg = mask_to_msg(mask)
    assert sum(msg.counts) == mask.size
    assert np.array_equal(mask_from_msg(msg), mask)


def test_a_mask_with_missing_runs_is_refused():
    """The message says how many pixels there are."""
    msg = mask_to_msg(np.ones((3, 4), bool))
    msg.counts = [0, 5]
    with pytest.raises(InvalidImageError, match="5 px"):
        mask_from_msg(msg)


def test_a_mask_travels_compactly():
    """A disc in a camera image takes two numbers a row."""
    v, u = np.ogrid[:480, :640]
    assert len(mask_to_msg((u - 300) ** 2 + (v - 200) ** 2 < 50**2).counts) < 250


def some_hands():
    rng = np.random.default_rng(4)
    metric = MetricRay(np.array([0.1, 0.2, 0.9]), np.array([0.12, 0.22, 0.85]), np.array([0.0, 0.6, -0.8]))
    ray = PointingRay((10.0, 20.0), (30.0, 40.0), (0.5, 0.75), 0.125, metric, "two_fingers")
    hands = (
        Hand("left", 0.75, rng.normal(100, 20, (21, 3)), ray, 0.875),
        Hand("right", 0.5, rng.normal(300, 20, (21, 3))),
    )
    return HandsFrame(12.5, "camera", 640, 480, hands, 0, "test", 0.25)


def test_hands_come_back():
    """Landmarks, rays and which hand points."""
    before = some_hands()
    after = hands_from_msg(hands_to_msg(before))
    assert (after.stamp_s, after.frame_id, after.width, after.height) == (12.5, "camera", 640, 480)
    assert (after.pointing_hand, after.backend, after.latency_s) == (0, "test", 0.25)
    for a, b in zip(after.hands, before.hands, strict=True):
        assert (a.handedness, a.score, a.depth_m, a.pointing) == (b.handedness, b.score, b.depth_m, b.pointing)
        assert a.landmarks == pytest.approx(b.landmarks)
    ray = after.hands[0].ray
    assert (ray.origin, ray.tip, ray.direction) == ((10.0, 20.0), (30.0, 40.0), (0.5, 0.75))
    assert (ray.sigma_rad, ray.style) == (0.125, "two_fingers")
    assert ray.metric.direction == pytest.approx([0.0, 0.6, -0.8])


def test_no_pointing_hand_is_none():
    """-1 in the message, None as a value."""
    msg = hands_to_msg(HandsFrame(1.0, "camera", 640, 480, ()))
    assert msg.pointing_hand == -1
    assert hands_from_msg(msg).pointing_hand is None


def some_detection():
    mask = np.zeros((48, 64), bool)
    mask[10:20, 5:30] = True
    pose = np.eye(4)
    pose[:3, 3] = (0.6, 0.1, 0.75)
    pose[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    cloud = np.random.default_rng(5).normal(0, 0.1, (40, 3)).astype(np.float32)
    body = Geometry(np.array([0.6, 0.1, 0.75]), pose, np.array([0.2, 0.1, 0.05]), cloud)
    return Detection(
        "thing_1", "bowl", 0.5, Box(5, 10, 30, 20), mask, body, (Attribute("colour", "red", 0.5),), (0.25, 0.75)
    )


def test_a_detection_comes_back():
    """With its mask, geometry, attributes and scores."""
    before = some_detection()
    after = detection_from_msg(detection_to_msg(before))
    assert (after.id, after.label, after.score, after.box) == ("thing_1", "bowl", 0.5, before.box)
    assert np.array_equal(after.mask, before.mask)
    assert after.geometry.pose == pytest.approx(before.geometry.pose)
    assert after.geometry.size == pytest.approx(before.geometry.size)
    assert np.array_equal(after.geometry.cloud, before.geometry.cloud)
    assert after.attributes == before.attributes
    assert after.phrase_scores == (0.25, 0.75)


def test_a_table_comes_back_and_none_stays_none():
    """Outlines in space and in the image."""
    corners = np.array([[0.5, -0.5, 0.75], [1.0, -0.5, 0.75], [1.0, 0.5, 0.75], [0.5, 0.5, 0.75]])
    table = TableSurface(corners, np.array([0.0, 0.0, 1.0]), np.array([[0.0, 1.0], [5.0, 1.0], [5.0, 9.0]]))
    after = table_from_msg(table_to_msg(table))
    assert after.polygon == pytest.approx(corners)
    assert after.image_polygon == pytest.approx(table.image_polygon)
    assert after.height_m == pytest.approx(0.75)
    assert table_from_msg(table_to_msg(None)) is None


def test_a_scene_comes_back():
    """As the answer of the service."""
    before = Scene(3.5, "base_footprint", (some_detection(),), None, (0.5, 0.25), "test", 0.125)
    response = scene_to_response(before)
    assert response.success
    after = scene_from_response(response)
    assert (after.stamp_s, after.frame_id, after.phrase_none) == (3.5, "base_footprint", (0.5, 0.25))
    assert (after.backend, after.latency_s, after.table) == ("test", 0.125, None)
    assert after.detections[0].id == "thing_1"
    assert response.detections[0].cloud.header.frame_id == "base_footprint"
