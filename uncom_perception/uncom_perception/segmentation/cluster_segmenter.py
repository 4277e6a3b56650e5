# SPDX-License-Identifier: Apache-2.0
"""Segmentation without weights: what is connected in depth, or GrabCut where there is no depth."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from uncom_perception.exceptions import InvalidImageError
from uncom_perception.segmentation.options import CLUSTER_SEGMENTER, ClusterSegmenterOptions
from uncom_perception.segmentation.segmenter import DepthImage, FloatArray, RgbImage, Segmenter
from uncom_perception.types import Box, Mask


class ClusterSegmenter(Segmenter):
    """GrabCut on colour; with depth, held to what is connected to the seed."""

    @property
    def name(self) -> str:
        """Name of the back end; it needs no weights."""
        return "grabcut with depth clusters (no weights)"

    def segment(
        self, image_rgb: RgbImage, depth: DepthImage | None, points: FloatArray, boxes: Sequence[Box]
    ) -> tuple[list[Mask], list[float]]:
        """Return masks and scores; a score is how much of the seed the mask holds and how firm its border is."""
        height, width = image_rgb.shape[:2]
        if depth is not None and depth.shape != (height, width):
            raise InvalidImageError(f"depth {depth.shape[::-1]} px is not registered to the image {width}x{height} px")
        half = CLUSTER_SEGMENTER.guess * width / 2.0
        seeds = [Box(u - half, v - half, u + half, v + half) for u, v in points] + list(boxes)
        masks, scores = [], []
        for box in seeds:
            u, v = box.center
            if not (0 <= u < width and 0 <= v < height):
                raise InvalidImageError(f"the point ({u:.0f}, {v:.0f}) is outside the image {width}x{height} px")
            mask = _grab(image_rgb, box)
            if depth is not None:
                mask &= _connected_depth(depth, box)
            mask = _piece_at(mask, box.center)
            masks.append(mask)
            scores.append(_score(mask, box))
        return masks, scores


def _grab(image_rgb: RgbImage, box: Box) -> Mask:
    height, width = image_rgb.shape[:2]
    margin = 0.35 * max(box.x_max - box.x_min, box.y_max - box.y_min) + 8
    x0, y0 = int(max(0, box.x_min - margin)), int(max(0, box.y_min - margin))
    x1, y1 = int(min(width, box.x_max + margin)), int(min(height, box.y_max + margin))
    part = np.ascontiguousarray(image_rgb[y0:y1, x0:x1, ::-1])
    state = np.full(part.shape[:2], cv2.GC_BGD, np.uint8)
    bx0, by0 = int(max(0, box.x_min - x0)), int(max(0, box.y_min - y0))
    bx1, by1 = int(box.x_max - x0), int(box.y_max - y0)
    state[by0:by1, bx0:bx1] = cv2.GC_PR_FGD
    cx, cy = (bx0 + bx1) // 2, (by0 + by1) // 2
    rx, ry = max(2, (bx1 - bx0) // 8), max(2, (by1 - by0) // 8)
    state[max(0, cy - ry) : cy + ry, max(0, cx - rx) : cx + rx] = cv2.GC_FGD
    mask = np.zeros((height, width), dtype=bool)
    if not (state == cv2.GC_BGD).any():
        state[0], state[-1] = cv2.GC_BGD, cv2.GC_BGD
    cv2.setRNGSeed(0)
    cv2.grabCut(part, state, None, np.zeros((1, 65)), np.zeros((1, 65)), 3, cv2.GC_INIT_WITH_MASK)
    mask[y0:y1, x0:x1] = (state == cv2.GC_FGD) | (state == cv2.GC_PR_FGD)
    return mask


def _connected_depth(depth: DepthImage, box: Box, *, options: ClusterSegmenterOptions = CLUSTER_SEGMENTER) -> Mask:
    """Return what is reached from the box's centre without a jump in depth (unknown depth does not stop)."""
    known = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).astype(np.float32)
    filled = cv2.morphologyEx(known, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    edge = (
        cv2.morphologyEx(filled, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        > np.maximum(options.depth_jump * filled, 0.008) * 2.0
    )
    _, labels = cv2.connectedComponents((~edge).astype(np.uint8), connectivity=4)
    u, v = (round(c) for c in box.center)
    v, u = min(v, depth.shape[0] - 1), min(u, depth.shape[1] - 1)
    seed = labels[max(0, v - 3) : v + 4, max(0, u - 3) : u + 4]
    seed = seed[seed > 0]
    if seed.size == 0:
        return np.ones(depth.shape, dtype=bool)
    region = (labels == np.bincount(seed).argmax()).astype(np.uint8)
    return np.asarray(cv2.dilate(region, np.ones((3, 3), np.uint8)).astype(bool))


def _piece_at(mask: Mask, center: tuple[float, float]) -> Mask:
    """Keep the piece of a mask at a point (or its largest one) and close its holes."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count <= 1:
        return mask
    u, v = round(center[0]), round(center[1])
    here = int(labels[min(v, mask.shape[0] - 1), min(u, mask.shape[1] - 1)])
    label = here if here > 0 else 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    piece = (labels == label).astype(np.uint8)
    contours, _ = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(piece, contours, -1, 1, cv2.FILLED)
    return np.asarray(piece.astype(bool))


def _score(mask: Mask, box: Box) -> float:
    area = max(1.0, (box.x_max - box.x_min) * (box.y_max - box.y_min))
    share = float(mask.sum()) / area
    return float(np.clip(0.9 * min(1.0, share / 0.2) * min(1.0, 1.6 - share), 0.0, 1.0))
