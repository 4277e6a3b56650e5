# SPDX-License-Identifier: Apache-2.0
"""Arms that reach over the table are no things; masks without depth."""

from __future__ import annotations

import numpy as np
import pytest
from perception_scenes import CAMERA, POSE, overlap, plain_table
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.segmentation.cluster_segmenter import ClusterSegmenter
from uncom_perception.types import Box

BLOCK = (0.65, 0.0, 0.1, 0.1, 0.1, (200, 30, 30))


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
        scene = TabletopDetector().detect(RgbdFrame(rgb, depth, CAMERA, POSE), [])
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
