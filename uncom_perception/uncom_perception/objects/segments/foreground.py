# SPDX-License-Identifier: Apache-2.0
"""Everything that stands on the table, as one mask an object."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.options import FOREGROUND, ForegroundOptions
from uncom_perception.objects.table.depth_noise import measure_noise
from uncom_perception.objects.table.table_outline import TopDown
from uncom_perception.objects.table.table_view import TableView
from uncom_perception.types import Mask

PointImage = npt.NDArray[np.float32]
LabelImage = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Surfaces:
    """What the camera sees, about the table: ground points (H, W, 3) as x, y, height [m], and Lab image.

    across (H, W - 1) and down (H - 1, W) tell whether a pixel touches the next one in space; see surfaces_of. A pixel
    is pixel_m wide on the table.
    """

    ground_points: PointImage
    lab: npt.NDArray[np.float32]
    across: Mask
    down: Mask
    pixel_m: float = 0.002

    def cut(self, box: tuple[slice, slice]) -> Surfaces:
        """Return a part of it; slices have a start and an end within it."""
        rows, columns = box
        across = self.across[rows, columns.start : columns.stop - 1]
        down = self.down[rows.start : rows.stop - 1, columns]
        return Surfaces(self.ground_points[box], self.lab[box], across, down, self.pixel_m)

    def thinned(self, stride: int) -> Surfaces:
        """Return every so many pixels; two touch if all between them do."""
        columns, rows = self.across.shape[1] // stride, self.down.shape[0] // stride
        wide, high = self.across[::stride, : columns * stride], self.down[: rows * stride, ::stride]
        across: Mask = np.logical_and.reduce([wide[:, k::stride] for k in range(stride)])
        down: Mask = np.logical_and.reduce([high[k::stride] for k in range(stride)])
        points, lab = self.ground_points[::stride, ::stride], self.lab[::stride, ::stride]
        across, down = across[:, : points.shape[1] - 1], down[: points.shape[0] - 1]
        return Surfaces(points, lab, across, down, self.pixel_m * stride)


def surfaces_of(view: TableView, lab: npt.NDArray[np.float32], *, options: ForegroundOptions = FOREGROUND) -> Surfaces:
    """Put surfaces together from what is seen of the table and a Lab image (H, W, 3) of the same."""
    # Neighbours are a pixel's width apart across the line of sight, and so much further along it.
    gap = max(options.gap_m, 6.0 * view.pixel_m)
    limit = np.float32(math.sqrt(gap * gap - view.pixel_m * view.pixel_m))
    away = view.range_m
    across, down = (np.abs(step) < limit for step in (away[:, 1:] - away[:, :-1], away[1:] - away[:-1]))
    return Surfaces(np.ascontiguousarray(view.points), lab, across, down, view.pixel_m)


def foreground(
    view: TableView, table: TopDown, *, options: ForegroundOptions = FOREGROUND
) -> tuple[Mask, npt.NDArray[np.float32]]:
    """Return the pixels (H, W) above the table, thin objects included, as far as the depth noise allows.

    With them comes how far from the table's outline each of them is, seen from above [m]; infinite elsewhere.
    """
    height = cv2.extractChannel(view.points, 2)
    known = height == height  # noqa: PLR0124  (only NaN is not)
    clipped = np.clip(height, np.float32(-0.05), np.float32(0.05))
    clipped[~known] = 0.0
    wide, narrow = (_averaged(clipped, known, size) for size in (5, 3))
    low = measure_noise(wide, view.depth, view.on_table).least_height(view.depth, options.least_height_m)
    # A pixel beside a tall object is lifted by the average, not by itself: it must be up there, too.
    candidates = np.flatnonzero(wide > low)
    lowest, mean = low.ravel()[candidates], wide.ravel()[candidates]
    own = clipped.ravel()[candidates] > np.float32(0.5) * mean
    own &= narrow.ravel()[candidates] > np.float32(0.6) * lowest
    own &= height.ravel()[candidates] < options.max_height_m
    above = candidates[own]
    apart = np.full(height.shape, np.inf, np.float32)
    apart.ravel()[above] = table.distance(view.points.reshape(-1, 3)[above])
    return apart < table.reach_m, apart


def _averaged(values: npt.NDArray[np.float32], known: Mask, size: int) -> npt.NDArray[np.float32]:
    """Return the mean of the known values (H, W) about each pixel; others are 0, and few known ones count less."""
    counts = cv2.boxFilter(known.view(np.uint8), -1, (size, size), normalize=False)
    shares = np.maximum(np.arange(256, dtype=np.float32), np.float32(0.3 * size * size))
    total = cv2.boxFilter(values, -1, (size, size), normalize=False)
    total *= cv2.LUT(counts, np.float32(1.0) / shares)
    return np.asarray(total, dtype=np.float32)


def connected(surfaces: Surfaces, pixels: Mask) -> LabelImage:
    """Label surfaces whose neighbouring pixels touch in space; 0 is background.

    The pixels are laid out with a cell between any two neighbours, which is filled where the two touch.
    """
    labels = np.zeros(pixels.shape, np.int32)
    box = mask_bounds(pixels)
    if box is None:
        return labels
    part, own = surfaces.cut(box), pixels[box]
    rows, columns = own.shape
    grid = np.zeros((2 * rows, 2 * columns), np.uint8)
    grid[::2, ::2] = own
    grid[::2, 1:-1:2] = part.across & own[:, 1:] & own[:, :-1]
    grid[1:-1:2, ::2] = part.down & own[1:] & own[:-1]
    labels[box] = cv2.connectedComponents(grid, connectivity=4)[1][::2, ::2]
    return labels


def mask_bounds(mask: Mask) -> tuple[slice, slice] | None:
    """Return the rows and columns that a mask (H, W) covers, None if it is empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return None if width == 0 else (slice(y, y + height), slice(x, x + width))
