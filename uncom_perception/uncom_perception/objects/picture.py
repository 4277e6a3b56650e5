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
_FIT_STRIDE = 6
_LEAST_SHARE = 0.0006  # of the picture
_EDGE_PX = 7.0  # from the outline of the table or of the picture: what lies there is hardly a thing
_THIN_PX = 16.0  # thinner pieces must be solid


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
            cv2.resize(m.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
            for m in _split(things, table)
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
    like = _like(lab, middle)
    region = _region(like)
    if region is None:
        return np.zeros(lab.shape[:2], bool), np.zeros(lab.shape[:2], bool)
    # Light falls unevenly on a table, and lamps colour it: its colour is a slow function of the place.
    even = _even_colour(lab, region & like)
    if even is not None:
        like = _like(lab, even)
    return region, region & ~like


def _like(lab: npt.NDArray[np.float32], table: npt.NDArray[np.floating]) -> Mask:
    """Return the pixels of a Lab picture (H, W, 3) that have the table's colour, (3,) or (H, W, 3)."""
    lightness = lab[..., 0] - table[..., 0]
    # In the shade chroma shrinks with lightness.
    share = np.clip(lab[..., 0] / np.maximum(table[..., 0], 1.0), 0.3, 1.2)[..., None]
    chroma = np.linalg.norm(lab[..., 1:] - table[..., 1:] * share, axis=2)
    like = (chroma < _CHROMA_LIMIT) & (lightness < _LIGHTER_LIMIT) & (lightness > -_DARKER_LIMIT)
    return np.asarray(like, dtype=bool)


def _region(like: Mask) -> Mask | None:
    """Return the convex outline, filled, of the largest piece of the table that is seen."""
    mask = cv2.morphologyEx(like.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return None
    largest = labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    contour = max(
        cv2.findContours(largest.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=cv2.contourArea
    )
    region = np.zeros(like.shape, np.uint8)
    cv2.fillPoly(region, [cv2.convexHull(contour)], 1)
    return region.astype(bool)


def _even_colour(lab: npt.NDArray[np.float32], table: Mask) -> npt.NDArray[np.float32] | None:
    """Fit the table's colour (H, W, 3) as a function of second order of the place; None if little of it is seen."""
    height, width = table.shape
    v, u = np.nonzero(table[::_FIT_STRIDE, ::_FIT_STRIDE])
    if len(v) < 200:
        return None
    values = lab[::_FIT_STRIDE, ::_FIT_STRIDE][v, u]
    terms = _terms(2.0 * u * _FIT_STRIDE / width - 1.0, 2.0 * v * _FIT_STRIDE / height - 1.0)
    keep = np.ones(len(v), bool)
    coefficients: npt.NDArray[np.floating] = np.zeros((6, 3))
    for _ in range(3):
        coefficients = np.linalg.lstsq(terms[keep], values[keep], rcond=None)[0]
        off = np.linalg.norm(values - terms @ coefficients, axis=1)
        keep = off < max(3.0, 2.5 * float(np.median(off[keep])))
    ys, xs = np.meshgrid(2.0 * np.arange(height) / height - 1.0, 2.0 * np.arange(width) / width - 1.0, indexing="ij")
    return np.asarray(_terms(xs.ravel(), ys.ravel()) @ coefficients, np.float32).reshape(height, width, 3)


def _terms(x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def _split(things: Mask, region: Mask) -> list[Mask]:
    """Return one mask a piece, without specks and without the slivers that the table's edge leaves."""
    opened = cv2.morphologyEx(things.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    labels, count = ndimage.label(opened)
    framed = np.pad(region, 1, constant_values=False).astype(np.uint8)
    inner = cv2.distanceTransform(framed, cv2.DIST_L2, 3)[1:-1, 1:-1] > _EDGE_PX
    masks = []
    for i in range(1, count + 1):
        mask = np.asarray(ndimage.binary_fill_holes(labels == i), dtype=bool)
        area = int(np.count_nonzero(mask))
        if not _LEAST_SHARE * things.size < area < 0.25 * things.size or np.count_nonzero(mask & inner) < 0.5 * area:
            continue
        thickness = 2.0 * float(cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3).max())
        if thickness > _THIN_PX or area > 0.5 * _solid_area(mask):
            masks.append(mask)
    return masks


def _solid_area(mask: Mask) -> float:
    contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return float(cv2.contourArea(cv2.convexHull(np.concatenate(contours))))


def _surface(region: Mask, scale: float) -> TableSurface | None:
    if not region.any():
        return None
    contours = cv2.findContours(region.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    outline = cv2.approxPolyDP(max(contours, key=cv2.contourArea), 3.0, True)[:, 0].astype(float) / scale
    return TableSurface(np.zeros((0, 3)), np.zeros(3), outline)
