# SPDX-License-Identifier: Apache-2.0
"""SAM on tiny random weights of the true classes: prompts, choice among its masks, post-processing."""

from __future__ import annotations

import numpy as np
import pytest
from perception_scenes import plain_table
from tiny_sam import write_tiny_sam
from uncom_perception.exceptions import InvalidImageError
from uncom_perception.segmentation import sam_segmenter as sam_module
from uncom_perception.segmentation.sam_segmenter import load_sam
from uncom_perception.types import Box

torch = pytest.importorskip("torch")

pytestmark = pytest.mark.slow  # importing torch alone takes seconds


@pytest.fixture(scope="module")
def sam(tmp_path_factory):
    return write_tiny_sam(tmp_path_factory.mktemp("sam"))


@pytest.fixture(scope="module")
def picture():
    return plain_table(blocks=[(0.6, 0.1, 0.1, 0.06, 0.08, (200, 30, 30))])


def test_sam_gives_a_mask_for_each_prompt(sam, picture):
    """By centre points of boxes as in the paper, by boxes as an option; holes closed, scores from 0 to 1."""
    rgb, depth = picture
    boxes = [Box(100, 100, 200, 180), Box(300, 200, 400, 330)]
    points = np.array([[150.0, 140.0]])
    for as_points in (True, False):
        segmenter = load_sam(sam, "cpu", boxes_as_points=as_points)
        masks, scores = segmenter.segment(rgb, depth, points, boxes)
        assert len(masks) == len(scores) == 3
        assert all(mask.shape == rgb.shape[:2] and mask.dtype == bool for mask in masks)
        assert all(0.0 <= score <= 1.0 for score in scores)
        assert ("centre points" in segmenter.name) == as_points
    centred = load_sam(sam, "cpu").segment(rgb, None, np.zeros((0, 2)), [Box(100, 100, 200, 180)])[0][0]
    assert np.array_equal(centred, load_sam(sam, "cpu").segment(rgb, None, points, [])[0][0])
    with pytest.raises(InvalidImageError, match="outside"):
        load_sam(sam, "cpu").segment(rgb, None, np.array([[700.0, 10.0]]), [])
    assert load_sam(sam, "cpu").segment(rgb, None, np.zeros((0, 2)), []) == ([], [])


RING, DISC, EVERYTHING = range(3)


def told_by(segmenter, monkeypatch, scores):
    """Let a SAM answer every prompt with a ring, a disc and everything, and predict these IoUs (prompts, 3) of them."""
    v, u = np.mgrid[0:16, 0:16]  # the square that the tiny model's masks cover; the picture is the upper 12 rows of it
    away = np.hypot(u - 7.5, v - 5.5)
    masks = np.stack([(away < 5.0) & (away > 2.2), away < 3.0, np.ones_like(away, bool)])
    model = segmenter._model

    def answer(**inputs):
        outputs = model(**inputs)
        assert outputs.iou_scores.shape == (1, len(scores), 3)
        assert outputs.pred_masks.shape == (1, len(scores), 3, 16, 16)
        outputs.iou_scores = torch.tensor([scores])
        outputs.pred_masks = torch.tensor(np.where(masks, 9.0, -9.0)).float().expand(1, len(scores), 3, 16, 16)
        return outputs

    monkeypatch.setattr(segmenter, "_model", answer)


def test_of_the_three_masks_of_sam_the_one_of_the_best_predicted_iou_is_taken(sam, picture, monkeypatch):
    """For each prompt on its own, in the order of the prompts; a prediction beyond 1 is told as 1."""
    segmenter = load_sam(sam, "cpu")
    told_by(segmenter, monkeypatch, [[0.2, 0.3, 0.7], [0.1, 0.6, 0.2], [1.3, 0.9, 0.8]])
    points = np.array([[300.0, 220.0], [310.0, 230.0], [320.0, 240.0]])
    masks, scores = segmenter.segment(picture[0], None, points, [])
    assert scores == pytest.approx([0.7, 0.6, 1.0])
    everything, disc, ring = (float(mask.mean()) for mask in masks)
    assert everything == 1.0
    assert disc == pytest.approx(np.pi * 3.0**2 / (16 * 12), rel=0.15)
    assert ring == pytest.approx(np.pi * 5.0**2 / (16 * 12), rel=0.15)


def test_holes_of_a_mask_of_sam_are_closed_and_nothing_else(sam, picture, monkeypatch):
    """Post-processing leaves the hole of the ring; it is filled, and what lies outside the ring stays outside."""
    segmenter = load_sam(sam, "cpu")
    told_by(segmenter, monkeypatch, [[0.9, 0.1, 0.1]])
    raw = []
    closed = sam_module._closed
    monkeypatch.setattr(sam_module, "_closed", lambda mask: raw.append(mask) or closed(mask))
    (mask,), _ = segmenter.segment(picture[0], None, np.array([[320.0, 240.0]]), [])
    v, u = 5.9 * 480 / 12, 7.9 * 640 / 16  # about the middle of the ring [px]
    assert not raw[0][int(v), int(u)]
    assert mask[int(v), int(u)]
    assert mask[raw[0]].all()
    far = np.hypot(np.arange(640)[None] - u, np.arange(480)[:, None] - v) > 6.0 * 640 / 16
    assert not mask[far].any()
