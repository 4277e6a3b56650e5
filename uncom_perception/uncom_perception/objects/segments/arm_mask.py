# SPDX-License-Identifier: Apache-2.0
"""Hands and bare forearms: seen by their landmarks, followed by their colour and their surface."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from uncom_perception.hands.detection.landmarks import FINGERS, Landmark
from uncom_perception.objects.segments.foreground import Surfaces, connected
from uncom_perception.objects.segments.options import ARM_MASK
from uncom_perception.types import HandsFrame, Mask


def hand_pixels(surfaces: Surfaces, above: Mask, hands: HandsFrame | None, corner: tuple[int, int] = (0, 0)) -> Mask:
    """Return the pixels of hands and of the bare forearms behind them: skin coloured and connected to the landmarks.

    The surfaces may be a part of the image with its upper left corner (u, v) there.
    """
    mask = np.zeros(above.shape, dtype=bool)
    if hands is None:
        return mask
    points = surfaces.ground_points
    for hand in hands.hands:
        skeleton, core = _skeleton(hand.landmarks - np.array([*corner, 0.0]), above.shape)
        sample = core & above
        if sample.sum() < ARM_MASK.least_sample_px:
            continue
        skin = _like_sample(surfaces.lab, surfaces.lab[sample])
        candidates = above & (skin | core)
        labels = connected(surfaces, candidates)
        touched = np.bincount(labels[sample], minlength=labels.max() + 1)
        touched[0] = 0
        chosen = np.flatnonzero(touched > max(10, 0.08 * touched.sum()))
        # What is at the depth of the finger bones belongs to the hand whatever its colour (nails, shadows, rings).
        hand_height = float(np.nanmedian(points[..., 2][sample]))
        close = skeleton & above & (points[..., 2] > min(0.02, 0.5 * hand_height)) & skin
        found = np.isin(labels, chosen) | close
        mask |= cv2.dilate(found.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    return mask


def bare_skin(lab: npt.NDArray[np.float32], above: Mask, hands: HandsFrame, scale: float = 1.0) -> Mask:
    """Return the pixels of hands and bare forearms in a picture without depth, scaled from the one the hands are of."""
    mask = np.zeros(above.shape, dtype=bool)
    for hand in hands.hands:
        thick, core = _skeleton(hand.landmarks * scale, above.shape)
        if core.sum() < ARM_MASK.least_sample_px:
            continue
        skin = _like_sample(lab, lab[core])
        labels, _ = ndimage.label((above & skin) | core)
        touched = np.unique(labels[core])
        mask |= np.isin(labels, touched[touched > 0]) | thick
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool))


def _like_sample(lab: npt.NDArray[np.float32], sample: npt.NDArray[np.float32]) -> Mask:
    """Return the pixels (H, W) whose colour is that of a sample (N, 3), lightness free within its shading."""
    middle = np.median(sample, axis=0)
    spread = np.maximum(1.4826 * np.median(np.abs(sample - middle), axis=0), (8.0, 4.0, 4.0))
    return np.asarray((np.abs(lab - middle) < np.array([5.0, 3.5, 3.5]) * spread).all(axis=2))


def _skeleton(landmarks: npt.NDArray[np.float64], shape: tuple[int, ...]) -> tuple[Mask, Mask]:
    """Draw a hand's bones, thick (all of the hand) and thin (surely hand)."""
    marks = np.round(landmarks[:, :2]).astype(np.int32)
    size = float(np.ptp(marks, axis=0).max())
    thick, thin = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    lines = [marks[list(joints)] for joints in FINGERS.values()]
    lines += [marks[[Landmark.WRIST, joints[0]]] for joints in FINGERS.values()]
    palm = marks[[Landmark.WRIST, 1, Landmark.INDEX_MCP, Landmark.MIDDLE_MCP, 13, Landmark.PINKY_MCP]]
    for image, width in ((thick, max(3, round(0.16 * size))), (thin, max(1, round(0.04 * size)))):
        cv2.polylines(image, [line.reshape(-1, 1, 2) for line in lines], False, 1, width)
        cv2.fillPoly(image, [cv2.convexHull(palm.reshape(-1, 1, 2))], 1)
    return thick.astype(bool), thin.astype(bool)
