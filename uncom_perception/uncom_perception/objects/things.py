# SPDX-License-Identifier: Apache-2.0
"""From labelled surfaces to things: fragments joined, hands and arms taken out, masks closed."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera

from uncom_perception.objects.arms import hand_pixels
from uncom_perception.objects.joining import join_fragments, join_hollow
from uncom_perception.objects.segments import LabelImage, Surfaces, connected, foreground, label_boxes
from uncom_perception.objects.splitting import split_touching
from uncom_perception.objects.table import TopDown
from uncom_perception.types import HandsFrame, Mask

_MIN_PIXELS = 45
_MIN_EXTENT_M = 0.012
_FLOATING_M = 0.03
_TALLEST_M = 0.45


def find_things(
    surfaces: Surfaces,
    on_table: Mask,
    table: TopDown,
    around: TopDown,
    hands: HandsFrame | None,
    camera: PinholeCamera,
) -> list[Mask]:
    """Return one mask (H, W) for each thing on the table, hands and arms left out."""
    pixels = foreground(surfaces, on_table, around)
    pixels &= ~hand_pixels(surfaces, pixels, hands)
    labels = connected(surfaces, pixels)
    labels = split_touching(surfaces, _without_specks(labels))
    labels = join_hollow(surfaces, join_fragments(surfaces, labels))
    inside = np.zeros(labels.shape, dtype=bool)
    inside[labels > 0] = table.inside(surfaces.ground_points[labels > 0][:, :2])
    boxes = label_boxes(labels)
    masks = []
    for label, box in boxes.items():
        mask = np.zeros(labels.shape, dtype=bool)
        mask[box] = labels[box] == label
        if _is_thing(surfaces, labels, label, box, inside, camera):
            masks.append(_closed(mask, box))
    return masks


def _without_specks(labels: LabelImage) -> LabelImage:
    sizes = np.bincount(labels.ravel())
    keep = sizes >= 12
    keep[0] = False
    renumber = np.zeros(len(sizes), np.int32)
    renumber[keep] = np.arange(1, keep.sum() + 1)
    return renumber[labels]


def _is_thing(
    surfaces: Surfaces, labels: LabelImage, label: int, box: tuple[slice, slice], inside: Mask, camera: PinholeCamera
) -> bool:
    """Whether a surface is a thing that stands on the table (or on another thing), not an arm, a hand or a speck."""
    own = labels[box] == label
    points = surfaces.ground_points[box][own]
    if len(points) < _MIN_PIXELS or np.ptp(points[:, :2], axis=0).max() < _MIN_EXTENT_M:
        return False
    if np.percentile(points[:, 2], 98) > _TALLEST_M:
        return False
    share_inside = float(inside[box][own].mean())
    if share_inside < 0.6:
        return False
    outside = points[~inside[box][own]]
    if len(outside) and float(np.ptp(outside[:, :2], axis=0).max()) > 0.2:
        return False
    # The lower half of a round thing is not seen from above, so it seems to begin at up to half its width.
    width = float(np.ptp(points[:, :2], axis=0).min())
    if np.percentile(points[:, 2], 4) < max(_FLOATING_M, 0.015 + 0.5 * width):
        return True
    return not _hovers(labels, label, box, camera)


def _hovers(labels: LabelImage, label: int, box: tuple[slice, slice], camera: PinholeCamera) -> bool:
    """Whether the bare table is seen below a thing that does not reach it."""
    own = (labels[box] == label).astype(np.uint8)
    padded = np.zeros((own.shape[0] + 8, own.shape[1]), np.uint8)
    padded[: own.shape[0]] = own
    below = (np.roll(padded, 6, axis=0) > 0) & (cv2.dilate(padded, np.ones((3, 3), np.uint8)) == 0)
    v, u = np.nonzero(below)
    v, u = v + box[0].start, u + box[1].start
    seen = v < camera.height
    v, u = v[seen], u[seen]
    if len(v) < 5:
        return False
    return float((labels[v, u] == 0).mean()) > 0.6


def hidden_share(mask: Mask, depth: npt.NDArray[np.float32]) -> float:
    """Return how much of a thing's outline is not its own: cut by the image's border or by something nearer, 0 to 1."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    y0, x0 = max(0, int(rows[0]) - 5), max(0, int(columns[0]) - 5)
    box = np.s_[y0 : int(rows[-1]) + 6, x0 : int(columns[-1]) + 6]
    part = mask[box].astype(np.uint8)
    own = np.where((part > 0) & np.isfinite(depth[box]), depth[box], np.float32(0.0)).astype(np.float32)
    ring = (cv2.dilate(part, np.ones((9, 9), np.uint8)) > 0) & (cv2.dilate(part, np.ones((5, 5), np.uint8)) == 0)
    with np.errstate(invalid="ignore"):
        nearer = ring & (depth[box] < cv2.dilate(own, np.ones((9, 9), np.uint8)) - 0.03)
    cut = int(mask[:, :2].any(axis=1).sum() + mask[:, -2:].any(axis=1).sum())
    cut += int(mask[:2].any(axis=0).sum() + mask[-2:].any(axis=0).sum())
    outline = float(ring.sum()) / 2.0 + cut
    return float(np.clip(2.5 * (0.5 * float(nearer.sum()) + cut) / max(outline, 1.0), 0.0, 1.0))


def _closed(mask: Mask, box: tuple[slice, slice]) -> Mask:
    """Close the holes that missing depth leaves in a mask."""
    rows = slice(max(0, box[0].start - 4), box[0].stop + 4)
    columns = slice(max(0, box[1].start - 4), box[1].stop + 4)
    part = np.ascontiguousarray(mask[rows, columns]).astype(np.uint8)
    part = cv2.morphologyEx(part, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    result = np.zeros_like(mask)
    result[rows, columns] = part.astype(bool)
    return result
