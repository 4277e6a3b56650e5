# SPDX-License-Identifier: Apache-2.0
"""Things on a table in a plain picture: what does not have the table's colour. Less sure than with depth."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage
from uncom_common.camera import PinholeCamera

from uncom_perception.objects.arms import bare_skin
from uncom_perception.objects.colour import exposure, name_colours
from uncom_perception.objects.detector import DepthImage, FloatArray, ObjectDetector, RgbImage, check_images
from uncom_perception.objects.phrases import PhraseMatcher
from uncom_perception.objects.scenes import answer
from uncom_perception.types import HandsFrame, Mask, Scene, TableSurface

_TRUST = 0.5
_CHROMA_LIMIT = 9.0
_LIGHTER_LIMIT, _DARKER_LIMIT = 14.0, 34.0  # shadows darken the table without changing its hue much
_WORK_WIDTH = 640


class PictureDetector(ObjectDetector):
    """Table colour model and connected components; no geometry."""

    def __init__(self, matcher: PhraseMatcher) -> None:
        """Name things by colour alone (and rank them by size in the picture)."""
        self._matcher = matcher

    @property
    def name(self) -> str:
        """Name of the back end."""
        return "tabletop without depth (table colour, lower scores)"

    def detect(
        self,
        image_rgb: RgbImage,
        depth: DepthImage | None,
        camera: PinholeCamera | None,
        camera_in_base: FloatArray | None,  # noqa: ARG002  (no geometry without depth)
        phrases: Sequence[str],
        hands: HandsFrame | None = None,
        stamp_s: float = 0.0,
    ) -> Scene:
        """Return what differs from the table's colour."""
        check_images(image_rgb, depth, camera)
        start = time.perf_counter()
        scale = min(1.0, _WORK_WIDTH / image_rgb.shape[1])
        small = np.asarray(
            cv2.resize(image_rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else image_rgb,
            dtype=np.uint8,
        )
        lab = np.asarray(
            cv2.cvtColor(cv2.GaussianBlur(small, (5, 5), 0).astype(np.float32) / 255.0, cv2.COLOR_RGB2LAB), np.float32
        )
        table, things = _table_and_things(lab)
        if hands is not None:
            things &= ~bare_skin(lab, things, hands, scale)
        size = image_rgb.shape[1::-1]
        masks = [
            cv2.resize(m.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool) for m in _split(things)
        ]
        gain = exposure(image_rgb)
        found = [self._matcher.describe(None, name_colours(image_rgb[m], gain), float(np.sqrt(m.sum()))) for m in masks]
        scene = answer(
            self._matcher,
            [(mask, None) for mask in masks],
            found,
            _surface(table, scale),
            phrases,
            stamp_s=stamp_s,
            backend=self.name,
            trust=_TRUST,
        )
        return dataclasses.replace(scene, latency_s=time.perf_counter() - start)


def _table_and_things(lab: npt.NDArray[np.float32]) -> tuple[Mask, Mask]:
    """Return the table's pixels and those of what is on it.

    The table is the colour most common in the lower middle of the picture, where a camera that looks at a table has it.
    """
    height, width = lab.shape[:2]
    sample = lab[int(0.3 * height) : int(0.95 * height), int(0.15 * width) : int(0.85 * width)].reshape(-1, 3)
    binned = np.round(sample / np.array([10.0, 5.0, 5.0], np.float32)).astype(np.int32)
    values, counts = np.unique(binned, axis=0, return_counts=True)
    middle = values[counts.argmax()] * np.array([10.0, 5.0, 5.0])
    near = sample[(np.abs(sample - middle) < np.array([14.0, 7.0, 7.0])).all(axis=1)]
    middle = np.median(near, axis=0)
    lightness = lab[..., 0] - middle[0]
    # In the shade chroma shrinks with lightness.
    share = np.clip(lab[..., 0] / max(float(middle[0]), 1.0), 0.3, 1.2)[..., None]
    chroma = np.linalg.norm(lab[..., 1:] - middle[1:] * share, axis=2)
    like = (chroma < _CHROMA_LIMIT) & (lightness < _LIGHTER_LIMIT) & (lightness > -_DARKER_LIMIT)
    mask = cv2.morphologyEx(like.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return np.zeros(lab.shape[:2], bool), np.zeros(lab.shape[:2], bool)
    largest = labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    contour = max(
        cv2.findContours(largest.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=cv2.contourArea
    )
    region = np.zeros(lab.shape[:2], np.uint8)
    cv2.fillPoly(region, [cv2.convexHull(contour)], 1)
    return region.astype(bool), region.astype(bool) & ~like


def _split(things: Mask) -> list[Mask]:
    opened = cv2.morphologyEx(things.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    labels, count = ndimage.label(opened)
    masks = []
    for i in range(1, count + 1):
        mask = ndimage.binary_fill_holes(labels == i)
        if 0.0004 * things.size < mask.sum() < 0.25 * things.size:
            masks.append(np.asarray(mask, dtype=bool))
    return masks


def _surface(region: Mask, scale: float) -> TableSurface | None:
    if not region.any():
        return None
    contours = cv2.findContours(region.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    outline = cv2.approxPolyDP(max(contours, key=cv2.contourArea), 3.0, True)[:, 0].astype(float) / scale
    return TableSurface(np.zeros((0, 3)), np.zeros(3), outline)
