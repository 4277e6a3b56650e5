# SPDX-License-Identifier: Apache-2.0
"""Objects on a table in a plain picture: what does not have the table's colour. Less sure than with depth."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.exposure import exposure
from uncom_perception.objects.attributes.colour import name_colours
from uncom_perception.objects.attributes.phrase_matcher import PhraseMatcher
from uncom_perception.objects.attributes.scene_builder import answer
from uncom_perception.objects.detectors.detector import ObjectDetector
from uncom_perception.objects.detectors.options import PICTURE_DETECTOR, PictureDetectorOptions
from uncom_perception.objects.detectors.picture_pieces import pieces_of
from uncom_perception.objects.segments.arm_mask import bare_skin
from uncom_perception.rgbd_frame import RgbdFrame
from uncom_perception.types import LEAST_CORNERS, HandsFrame, Mask, Scene, TableSurface


class PictureDetector(ObjectDetector):
    """Table colour model and connected components; no geometry."""

    def __init__(self, matcher: PhraseMatcher, *, options: PictureDetectorOptions = PICTURE_DETECTOR) -> None:
        """Name objects by colour alone (and rank them by size in the picture)."""
        self._options = options
        self._matcher = matcher

    @property
    def name(self) -> str:
        """Name of the back end."""
        return "tabletop without depth (table colour, lower scores)"

    def detect(self, frame: RgbdFrame, phrases: Sequence[str], hands: HandsFrame | None = None) -> Scene:
        """Return what differs from the table's colour."""
        start, image_rgb = time.perf_counter(), frame.rgb
        scale = min(1.0, self._options.work_width_px / image_rgb.shape[1])
        small = np.asarray(
            cv2.resize(image_rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else image_rgb,
            dtype=np.uint8,
        )
        lab = np.asarray(
            cv2.cvtColor(cv2.GaussianBlur(small, (5, 5), 0).astype(np.float32) / 255.0, cv2.COLOR_RGB2LAB), np.float32
        )
        table, objects = _table_and_things(lab, options=self._options)
        if hands is not None:
            objects &= ~bare_skin(lab, objects, hands, scale)
        size = image_rgb.shape[1::-1]
        masks = [
            cv2.resize(m.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST).astype(bool)
            for m in pieces_of(objects, table, small, lab)
        ]
        gain = exposure(image_rgb)
        found = [self._matcher.describe(None, name_colours(image_rgb[m], gain), float(np.sqrt(m.sum()))) for m in masks]
        scene = answer(
            self._matcher,
            [(mask, None) for mask in masks],
            found,
            _surface(table, scale),
            phrases,
            frame=frame,
            backend=self.name,
            trust=self._options.trust,
        )
        return dataclasses.replace(scene, latency_s=time.perf_counter() - start)


def _table_and_things(
    lab: npt.NDArray[np.float32], *, options: PictureDetectorOptions = PICTURE_DETECTOR
) -> tuple[Mask, Mask]:
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
    like = _like(lab, middle, options=options)
    region = _region(like, options=options)
    if region is None:
        return np.zeros(lab.shape[:2], bool), np.zeros(lab.shape[:2], bool)
    # Light falls unevenly on a table, and lamps colour it: its colour is a slow function of the place.
    even = _even_colour(lab, region & like, options=options)
    if even is not None:
        like = _like(lab, even, options=options)
    return region, region & ~like


def _like(
    lab: npt.NDArray[np.float32], table: npt.NDArray[np.floating], *, options: PictureDetectorOptions = PICTURE_DETECTOR
) -> Mask:
    """Return the pixels of a Lab picture (H, W, 3) that have the table's colour, (3,) or (H, W, 3)."""
    lightness = lab[..., 0] - table[..., 0]
    # In the shade chroma shrinks with lightness.
    share = np.clip(lab[..., 0] / np.maximum(table[..., 0], 1.0), 0.3, 1.2)[..., None]
    chroma = np.linalg.norm(lab[..., 1:] - table[..., 1:] * share, axis=2)
    like = (chroma < options.chroma_limit) & (lightness < options.lighter_limit) & (lightness > -options.darker_limit)
    return np.asarray(like, dtype=bool)


def _region(like: Mask, *, options: PictureDetectorOptions = PICTURE_DETECTOR) -> Mask | None:
    """Return the convex outline, filled, of the largest piece of the table that is seen."""
    mask = cv2.morphologyEx(like.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count <= 1:
        return None
    pieces = np.argsort(-stats[1:, cv2.CC_STAT_AREA])[: options.max_table_pieces] + 1
    table = labels == pieces[0]
    hull = cv2.convexHull(_above_legs(table, _outline(table), options=options))
    for piece in pieces[1:]:  # a row of objects may part the table
        other = labels == piece
        area = int(stats[piece, cv2.CC_STAT_AREA])
        if (
            area > options.least_table_piece * like.size
            and np.count_nonzero(other & _filled(like.shape, hull)) > 0.5 * area
        ):
            table |= other
            continue
        wider = cv2.convexHull(np.vstack([hull, _outline(other)]))
        gained = _filled(like.shape, wider) & ~_filled(like.shape, hull)
        if area > options.least_table_piece * like.size and area > 0.5 * np.count_nonzero(gained):
            table |= other
            hull = cv2.convexHull(_above_legs(table, np.vstack([hull, _outline(other)]), options=options))
    return _filled(like.shape, hull)


def _outline(mask: Mask) -> npt.NDArray[np.int32]:
    """Return the outline (N, 1, 2) of the largest piece of a mask."""
    contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return np.asarray(max(contours, key=cv2.contourArea), dtype=np.int32)


def _above_legs(
    table: Mask, contour: npt.NDArray[np.int32], *, options: PictureDetectorOptions = PICTURE_DETECTOR
) -> npt.NDArray[np.int32]:
    """Return the outline's points without those of legs: between legs there is a wide gap that is open downwards."""
    whole = _filled(table.shape, cv2.convexHull(contour))
    count, labels, stats, _ = cv2.connectedComponentsWithStats((whole & ~table).astype(np.uint8))
    width = int(np.count_nonzero(whole.any(axis=0)))
    lowest = whole.shape[0] - 1 - whole[::-1].argmax(axis=0)
    for i in range(1, count):
        if stats[i, cv2.CC_STAT_WIDTH] < options.leg_gap_share * width:
            continue
        gap = labels == i
        columns = np.flatnonzero(gap.any(axis=0))
        bottom = gap.shape[0] - 1 - gap[::-1, columns].argmax(axis=0)
        open_below = np.count_nonzero(bottom >= lowest[columns] - 3)
        if open_below < options.leg_gap_share * width:
            continue
        slope, level = _commonest_line(columns.astype(float), gap[:, columns].argmax(axis=0).astype(float))
        kept = contour[contour[:, 0, 1] < level + slope * contour[:, 0, 0] + 2.0]
        contour = kept if len(kept) >= LEAST_CORNERS else contour
    return contour


def _commonest_line(x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Return slope and level of the line through two of the points that most others lie on, and fewest above.

    It is the front edge of a table; objects may stand out over it, and the gap under it has no other upper side.
    """
    i, j = np.triu_indices(24, 1)
    at = np.linspace(0, len(x) - 1, 24).astype(int)
    i, j = at[i], at[j]
    apart = x[j] - x[i] > 0.05 * (x[-1] - x[0])
    i, j = i[apart], j[apart]
    slopes = (y[j] - y[i]) / (x[j] - x[i])
    levels = y[i] - slopes * x[i]
    votes = np.count_nonzero(np.abs(y - slopes[:, None] * x - levels[:, None]) < PICTURE_DETECTOR.line_error_px, axis=1)
    best = int(np.where(np.abs(slopes) < PICTURE_DETECTOR.steepest_line, votes, -1).argmax())
    return float(slopes[best]), float(levels[best])


def _filled(shape: tuple[int, ...], outline: npt.NDArray[np.int32]) -> Mask:
    mask = np.zeros(shape[:2], np.uint8)
    cv2.fillPoly(mask, [outline], 1)
    return mask.astype(bool)


def _even_colour(
    lab: npt.NDArray[np.float32], table: Mask, *, options: PictureDetectorOptions = PICTURE_DETECTOR
) -> npt.NDArray[np.float32] | None:
    """Fit the table's colour (H, W, 3) as a function of second order of the place; None if little of it is seen."""
    height, width = table.shape
    v, u = np.nonzero(table[:: options.fit_stride, :: options.fit_stride])
    if len(v) < options.least_fit_pixels:
        return None
    values = lab[:: options.fit_stride, :: options.fit_stride][v, u]
    terms = _terms(2.0 * u * options.fit_stride / width - 1.0, 2.0 * v * options.fit_stride / height - 1.0)
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


def _surface(region: Mask, scale: float) -> TableSurface | None:
    if not region.any():
        return None
    contours = cv2.findContours(region.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    outline = cv2.approxPolyDP(max(contours, key=cv2.contourArea), 3.0, True)[:, 0].astype(float) / scale
    return TableSurface(np.zeros((0, 3)), np.zeros(3), outline)
