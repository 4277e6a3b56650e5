# SPDX-License-Identifier: Apache-2.0
"""What of all that rises above the table is an object that stands there."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import medians, quantile, quantiles
from uncom_perception.objects.segments.foreground import LabelImage, Surfaces
from uncom_perception.objects.segments.options import ON_TABLE, OnTableOptions
from uncom_perception.objects.segments.regions import Regions
from uncom_perception.types import Mask


@dataclass(frozen=True, slots=True)
class Reach:
    """How far (flat) pixels are from the table, seen from above [m], and how far objects may be."""

    apart: npt.NDArray[np.float32]
    inside_m: float  # over it, or hardly beside it
    beside_m: float  # so near that what is there may hide its edge
    followed_m: float  # not at the end of what is looked at about it


def stands_on_table(
    surfaces: Surfaces,
    regions: Regions,
    label: int,
    box: tuple[slice, slice],
    reach: Reach,
    *,
    options: OnTableOptions = ON_TABLE,
) -> bool:
    """Whether a surface is an object that stands on the table (or on another object), not an arm, a wall or a speck.

    Args:
        options: numbers that tune it.
        surfaces: what is seen.
        regions: all surfaces above the table.
        label: the one that is asked about.
        box: rows and columns of it.
        reach: where pixels are, from the table.
    """
    pixels = regions.of(label)
    points = surfaces.ground_points.reshape(-1, 3)[pixels]
    if len(points) < options.least_pixels or max(_sides(points)) < options.least_extent_m:
        return False
    labels = regions.labels
    bottom, top = quantiles(points[:, 2], (4, 98))
    if top > options.tallest_m or not _on_table(surfaces, regions, label, box, reach, options=options):
        return False
    dent = top < options.low_m and not _unlike_table(surfaces, labels, labels[box] == label, box, options=options)
    if dent or (len(points) < options.sliver_pixels and _along_another(regions, label, box)):
        return False
    # The lower half of a round object is not seen from above, so it seems to begin at up to half its width.
    if bottom < max(options.floating_m, 0.015 + 0.5 * min(_sides(points))):
        return True
    below = _below(labels, label, box)
    if below is None:
        return True
    # Below it are the table, or an arm: not another object that may hide its foot, nor a shadow of the depth camera.
    free = (labels[below] == 0) & np.isfinite(surfaces.ground_points[..., 2][below])
    return float(free.mean()) <= options.free_outline


def _sides(points: npt.NDArray[np.float32]) -> tuple[float, float]:
    return float(np.ptp(points[:, 0])), float(np.ptp(points[:, 1]))


def _on_table(
    surfaces: Surfaces,
    regions: Regions,
    label: int,
    box: tuple[slice, slice],
    reach: Reach,
    *,
    options: OnTableOptions = ON_TABLE,
) -> bool:
    """Whether a surface is over the table that is seen, or ends at its level where objects hide the table's edge."""
    pixels = regions.of(label)
    apart = reach.apart[pixels]
    inside = apart <= reach.inside_m
    if inside.all():
        return True
    if np.count_nonzero(apart > reach.followed_m) > options.few_outside:
        return False  # it comes from far: an arm
    points = surfaces.ground_points.reshape(-1, 3)[pixels]
    if float(inside.mean()) >= options.inside_share:
        outside = points[~inside]
        # An arm reaches in through the air; a pan at the table's edge lies low.
        return not (
            max(_sides(outside)) > options.long_outside_m and quantile(outside[:, 2], 50) > options.in_the_air_m
        )
    if (
        float((apart <= reach.beside_m).mean()) < options.beside_share
        or quantile(points[:, 2], 4) > 2.0 * options.floating_m
    ):
        return False
    below = _below(regions.labels, label, box)
    if below is None:
        return False
    heights = surfaces.ground_points[..., 2][below]
    heights = heights[np.isfinite(heights)]
    level = np.abs(heights) < options.level_m
    return bool(
        len(heights) >= options.least_below_px
        and level.mean() > options.level_share
        and (heights < options.sunken_m).mean() < options.sunken_share
    )


def _below(
    labels: LabelImage, label: int, box: tuple[slice, slice]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]] | None:
    """Return the pixels just below a surface in the image; None if hardly any are in the image."""
    own = (labels[box] == label).astype(np.uint8)
    padded = np.zeros((own.shape[0] + 8, own.shape[1]), np.uint8)
    padded[: own.shape[0]] = own
    below = (np.roll(padded, 6, axis=0) > 0) & (cv2.dilate(padded, np.ones((3, 3), np.uint8)) == 0)
    v, u = np.nonzero(below)
    v, u = v + box[0].start, u + box[1].start
    seen = v < labels.shape[0]
    return (v[seen], u[seen]) if np.count_nonzero(seen) >= ON_TABLE.least_below_px else None


def _around(labels: LabelImage, own: Mask, box: tuple[slice, slice], reach: int) -> tuple[Mask, tuple[slice, slice]]:
    """Return the pixels within a reach about a surface, and the rows and columns that they are given in."""
    rows, columns = (slice(max(0, s.start - reach), s.stop + reach) for s in box)
    padded = np.zeros(labels[rows, columns].shape, np.uint8)
    inner = np.s_[box[0].start - rows.start :, box[1].start - columns.start :]
    padded[inner][: own.shape[0], : own.shape[1]] = own
    grown = cv2.dilate(padded, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    return (grown > padded), (rows, columns)


def _unlike_table(
    surfaces: Surfaces, labels: LabelImage, own: Mask, box: tuple[slice, slice], *, options: OnTableOptions = ON_TABLE
) -> bool:
    """Whether a low surface has another colour than the table about it: else it is a dent in the depth."""
    ring, where = _around(labels, own, box, 7)
    ring &= labels[where] == 0
    if np.count_nonzero(ring) < options.least_ring_px:
        return True
    weight = np.array([0.5, 1.0, 1.0], np.float32)
    table = surfaces.lab[where][ring] * weight
    middle = medians(table)
    spread = quantile(np.linalg.norm(table - middle, axis=1), 50)
    mine = np.linalg.norm(surfaces.lab[box][own] * weight - middle, axis=1)
    return quantile(mine, 50) > max(options.unlike_table, 2.2 * spread)


def _along_another(regions: Regions, label: int, box: tuple[slice, slice]) -> bool:
    """Whether a small surface lies along the outline of a larger one for much of its own."""
    ring, where = _around(regions.labels, regions.labels[box] == label, box, 3)
    beside = regions.labels[where][ring]
    other = beside[(beside != 0) & (beside != label)]
    if len(other) < 0.3 * len(beside):
        return False
    sizes = regions.sizes
    return bool(sizes[np.bincount(other).argmax()] > 3 * sizes[label])
