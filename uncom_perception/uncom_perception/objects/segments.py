# SPDX-License-Identifier: Apache-2.0
"""Everything that stands on the table, as one mask a thing."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from uncom_perception.objects.level import measure_noise
from uncom_perception.objects.table import TopDown
from uncom_perception.objects.viewpoint import TableView
from uncom_perception.types import Mask

PointImage = npt.NDArray[np.float32]
LabelImage = npt.NDArray[np.int32]

_GAP_M = 0.012  # neighbouring pixels further apart than this (or 6 pixel widths) belong to different surfaces
_MAX_HEIGHT_M = 0.6
_LEAST_HEIGHT_M = 0.0022


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


def surfaces_of(points: PointImage, lab: npt.NDArray[np.float32], pixel_m: float) -> Surfaces:
    """Put surfaces together from points (H, W, 3) and a Lab image; a pixel is so wide on the table [m]."""
    limit = np.float32(max(_GAP_M, 6.0 * pixel_m) ** 2)
    across = _squared(points[:, 1:] - points[:, :-1]) < limit
    down = _squared(points[1:] - points[:-1]) < limit
    return Surfaces(points, lab, across, down, pixel_m)


def foreground(view: TableView, table: TopDown) -> tuple[Mask, npt.NDArray[np.float32]]:
    """Return the pixels (H, W) above the table, thin things included, as far as the depth noise allows.

    With them comes how far from the table's outline each of them is, seen from above [m]; infinite elsewhere.
    """
    height = view.points[..., 2]
    known = np.isfinite(height)
    clipped = np.clip(np.where(known, height, np.float32(0.0)), -0.05, 0.05)
    weight = known.astype(np.float32)
    wide, narrow = (
        cv2.blur(clipped, (size, size)) / np.maximum(cv2.blur(weight, (size, size)), np.float32(0.3)) for size in (5, 3)
    )
    low = measure_noise(wide, view.depth, view.on_table).least_height(view.depth, _LEAST_HEIGHT_M)
    # A pixel beside a tall thing is lifted by the average, not by itself: it must be up there, too.
    with np.errstate(invalid="ignore"):
        above = (wide > low) & (narrow > np.float32(0.6) * low) & (clipped > np.float32(0.5) * wide)
        above &= height < _MAX_HEIGHT_M
    apart = np.full(height.shape, np.inf, np.float32)
    apart[above] = table.distance(view.points[above][:, :2])
    return apart < table.reach_m, apart


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


def _squared(difference: PointImage) -> npt.NDArray[np.float32]:
    return np.asarray(np.einsum("ijk,ijk->ij", difference, difference))


def mask_bounds(mask: Mask) -> tuple[slice, slice] | None:
    """Return the rows and columns that a mask (H, W) covers, None if it is empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return None if width == 0 else (slice(y, y + height), slice(x, x + width))


def label_boxes(labels: LabelImage) -> dict[int, tuple[slice, slice]]:
    """Return rows and columns that each label covers."""
    used = mask_bounds(labels > 0)
    if used is None:
        return {}
    top, left = used[0].start, used[1].start
    boxes = ndimage.find_objects(labels[used])
    return {
        i + 1: (slice(top + box[0].start, top + box[0].stop), slice(left + box[1].start, left + box[1].stop))
        for i, box in enumerate(boxes)
        if box is not None
    }
