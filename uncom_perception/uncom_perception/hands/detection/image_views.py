# SPDX-License-Identifier: Apache-2.0
"""Other looks at an image in which no hand was found: crops, scales, turns, contrast."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.hands.detection.detector import RawHand
from uncom_perception.image_arrays import RgbImage

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class View:
    """A part of an image with a margin that continues its border, turned by quarter turns and scaled.

    It knows the way back.
    """

    x_min: int
    y_min: int
    width: int
    height: int
    quarter_turns: int = 0
    scale: float = 1.0
    contrast: bool = False
    margin: int = 0

    def cut(self, image_rgb: RgbImage) -> RgbImage:
        """Return the view's own image."""
        part = image_rgb[self.y_min : self.y_min + self.height, self.x_min : self.x_min + self.width]
        if self.contrast:
            part = _stretch(part)
        if self.margin:
            m = self.margin
            part = np.asarray(cv2.copyMakeBorder(part, m, m, m, m, cv2.BORDER_REPLICATE), dtype=np.uint8)
        part = np.rot90(part, self.quarter_turns)
        if self.scale != 1.0:
            part = cv2.resize(np.ascontiguousarray(part), None, fx=self.scale, fy=self.scale)
        return np.ascontiguousarray(part, dtype=np.uint8)

    def back(self, hand: RawHand) -> RawHand:
        """Return a hand found in the view in the coordinates of the whole image."""
        marks = hand.landmarks / self.scale
        world = hand.world
        whole_width, whole_height = self.width + 2 * self.margin, self.height + 2 * self.margin
        turned_width, turned_height = (
            (whole_width, whole_height) if self.quarter_turns % 2 == 0 else (whole_height, whole_width)
        )
        for _ in range(self.quarter_turns % 4):
            # np.rot90 turns counter-clockwise: (u, v) of the turned image lies at (previous width - v, u)
            turned_width, turned_height = turned_height, turned_width
            marks = np.column_stack([turned_width - marks[:, 1], marks[:, 0], marks[:, 2]])
            world = np.column_stack([-world[:, 1], world[:, 0], world[:, 2]])
        marks = marks + np.array([self.x_min - self.margin, self.y_min - self.margin, 0.0])
        return RawHand(hand.handedness, hand.score, marks, world)


def _stretch(part: RgbImage) -> RgbImage:
    """Equalise the lightness locally: dark hands against windows, overexposed ones."""
    lab = cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_RGB2LAB)
    lab[..., 0] = cv2.createCLAHE(clipLimit=3.0, tileGridSize=(4, 4)).apply(lab[..., 0])
    return np.asarray(cv2.cvtColor(lab, cv2.COLOR_LAB2RGB), dtype=np.uint8)


def around(center: npt.ArrayLike, size: float, image_shape: tuple[int, ...], quarter_turns: int = 0) -> View:
    """Return a square view about a point (2,) [px], at least 64 px wide, enlarged where it is small."""
    height, width = image_shape[:2]
    half = max(size, 64.0) / 2.0
    u, v = np.asarray(center, dtype=float)
    x_min, y_min = int(max(0, u - half)), int(max(0, v - half))
    x_max, y_max = int(min(width, u + half)), int(min(height, v + half))
    scale = float(np.clip(224.0 / max(x_max - x_min, y_max - y_min, 1), 1.0, 3.0))
    return View(x_min, y_min, max(1, x_max - x_min), max(1, y_max - y_min), quarter_turns, scale)


def whole(image_shape: tuple[int, ...], quarter_turns: int = 0, *, contrast: bool = False) -> View:
    """Return the whole image as a view."""
    return View(0, 0, image_shape[1], image_shape[0], quarter_turns, contrast=contrast)


def from_afar(image_shape: tuple[int, ...], share: float) -> View:
    """Return the whole image as if seen from further away, with a margin of a share of its size about it."""
    height, width = image_shape[:2]
    return View(0, 0, width, height, margin=round(share * max(height, width)))


def second_looks(image_shape: tuple[int, ...]) -> Iterator[View]:
    """Yield views worth a look when the plain image showed no hand, the likeliest first."""
    height, width = image_shape[:2]
    yield whole(image_shape, contrast=True)
    yield whole(image_shape, 2)
    yield from_afar(image_shape, 0.35)
    w, h = int(width * 0.6), int(height * 0.6)
    for x in (0, (width - w) // 2, width - w):
        for y in (0, height - h):
            yield View(x, y, w, h, 0, 1.0)
    yield whole(image_shape, 1)
    yield whole(image_shape, 3)
