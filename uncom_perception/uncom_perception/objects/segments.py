# SPDX-License-Identifier: Apache-2.0
"""Everything that stands on the table, as one mask a thing."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from uncom_perception.objects.plane import lowest_layer
from uncom_perception.objects.table import TopDown
from uncom_perception.types import Mask

PointImage = npt.NDArray[np.float32]
LabelImage = npt.NDArray[np.int32]

_GAP_M = 0.012  # neighbouring pixels further apart than this (or 6 pixel widths) belong to different surfaces
_MAX_HEIGHT_M = 0.6
_REACH_M = 0.25  # how far around the table things are followed, to see where arms come from
_MIN_PIXELS = 40


@dataclass(frozen=True, slots=True)
class Surfaces:
    """What the camera sees, about the table: ground points (H, W, 3) as x, y, height [m], Lab image, depth noise."""

    ground_points: PointImage
    lab: npt.NDArray[np.float32]
    sigma_m: float
    pixel_m: float  # width of a pixel on the table


def smooth_height(height: npt.NDArray[np.float32], size: int) -> npt.NDArray[np.float32]:
    """Average a height image (H, W) over squares, leaving out unknown pixels and jumps."""
    known = np.isfinite(height) & (np.abs(height) < 1.0)
    weight = cv2.blur(known.astype(np.float32), (size, size))
    total = cv2.blur(np.where(known, height, np.float32(0.0)), (size, size))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(weight > 0.3, total / weight, np.nan), dtype=np.float32)


def foreground(surfaces: Surfaces, on_table: Mask, near: TopDown) -> Mask:
    """Return the pixels (H, W) above the table, thin things included, as far as the depth noise allows."""
    height = surfaces.ground_points[..., 2]
    clipped = np.clip(height, -0.05, 0.05)
    wide, narrow = smooth_height(clipped, 5), smooth_height(clipped, 3)
    level, noise = lowest_layer(wide[on_table]) if on_table.any() else (0.0, 0.002)
    low = level + max(0.0022, 4.0 * noise)
    # A pixel beside a tall thing is lifted by the average, not by itself: it must be up there, too.
    with np.errstate(invalid="ignore"):
        above = (wide > low) & (narrow > 0.6 * low) & (clipped > 0.5 * wide) & (height < _MAX_HEIGHT_M)
    above[above] = near.inside(surfaces.ground_points[above][:, :2])
    return np.asarray(above)


def connected(surfaces: Surfaces, pixels: Mask) -> LabelImage:
    """Label surfaces whose neighbouring pixels touch in space; 0 is background."""
    number = np.full(pixels.shape, -1, np.int32)
    count = int(pixels.sum())
    number[pixels] = np.arange(count, dtype=np.int32)
    rows, columns = [], []
    points = surfaces.ground_points
    limit = max(_GAP_M, 6.0 * surfaces.pixel_m)
    for a, b in (
        (np.s_[:, :-1], np.s_[:, 1:]),
        (np.s_[:-1, :], np.s_[1:, :]),
        (np.s_[:-1, :-1], np.s_[1:, 1:]),
        (np.s_[:-1, 1:], np.s_[1:, :-1]),
    ):
        both = pixels[a] & pixels[b]
        gap = ((points[a][both] - points[b][both]) ** 2).sum(axis=1)
        joined = gap < limit**2
        rows.append(number[a][both][joined])
        columns.append(number[b][both][joined])
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = coo_matrix((np.ones(len(row), np.int8), (row, column)), shape=(count, count))
    labels = np.zeros(pixels.shape, np.int32)
    if count:
        labels[pixels] = connected_components(graph, directed=False)[1] + 1
    return labels


def label_boxes(labels: LabelImage) -> dict[int, tuple[slice, slice]]:
    """Return rows and columns that each label covers."""
    return {i + 1: (box[0], box[1]) for i, box in enumerate(ndimage.find_objects(labels)) if box is not None}
