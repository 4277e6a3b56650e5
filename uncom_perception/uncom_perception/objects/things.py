# SPDX-License-Identifier: Apache-2.0
"""From labelled surfaces to things: fragments joined, hands and arms taken out, masks closed."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.arms import hand_pixels
from uncom_perception.objects.detector import RgbImage
from uncom_perception.objects.filling import fill_by_colour
from uncom_perception.objects.joining import join_fragments, join_hollow, parted_labels
from uncom_perception.objects.lab import lab_image
from uncom_perception.objects.segments import LabelImage, connected, foreground, label_boxes, mask_bounds, surfaces_of
from uncom_perception.objects.splitting import split_touching
from uncom_perception.objects.standing import Reach, is_thing
from uncom_perception.objects.table import TopDown
from uncom_perception.objects.viewpoint import TableView
from uncom_perception.types import HandsFrame, Mask

_PAD = 10
_FOLLOW_M = 0.25  # how far around the table things are followed, to see where arms come from
_MARGINS_M = (0.03, 0.15, _FOLLOW_M - 0.02)  # see Reach


def find_things(image_rgb: RgbImage, view: TableView, hands: HandsFrame | None) -> list[Mask]:
    """Return one mask (H, W) for each thing on the table, hands and arms left out."""
    pixels, apart = foreground(view, TopDown(view.outline, _FOLLOW_M))
    bounds = mask_bounds(pixels)
    if bounds is None:
        return []
    whole = pixels.shape
    rows, columns = part = tuple(
        slice(max(0, s.start - _PAD), min(s.stop + _PAD, n)) for s, n in zip(bounds, whole, strict=True)
    )
    lab = lab_image(np.ascontiguousarray(image_rgb[part]))
    surfaces = surfaces_of(view.points[part], lab, view.pixel_m)
    pixels, apart = pixels[part], apart[part]
    pixels = pixels & ~hand_pixels(surfaces, pixels, hands, (columns.start, rows.start))
    labels = connected(surfaces, pixels)
    labels, origin = split_touching(surfaces, _without_specks(labels))
    labels, parted = join_fragments(surfaces, labels, parted_labels(surfaces, labels, origin))
    labels, parted = join_hollow(surfaces, labels, parted)
    taken = labels > 0
    reach = Reach(*(apart <= margin for margin in _MARGINS_M))
    masks = []
    for label, box in label_boxes(labels).items():
        if is_thing(surfaces, labels, label, box, reach):
            mask = np.zeros(whole, dtype=bool)
            window = mask[rows, columns]
            window[box] = labels[box] == label
            _close(window, box)
            fill_by_colour(window, taken, surfaces.lab, box)
            masks.append(mask)
    return masks


def _without_specks(labels: LabelImage) -> LabelImage:
    sizes = np.bincount(labels.ravel())
    keep = sizes >= 12
    keep[0] = False
    renumber = np.zeros(len(sizes), np.int32)
    renumber[keep] = np.arange(1, keep.sum() + 1)
    return renumber[labels]


def hidden_share(mask: Mask, depth: npt.NDArray[np.float32]) -> float:
    """Return how much of a thing's outline is not its own: cut by the image's border or by something nearer, 0 to 1."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    box = np.s_[max(0, y - 5) : y + height + 5, max(0, x - 5) : x + width + 5]
    part = mask[box].astype(np.uint8)
    own = np.where((part > 0) & np.isfinite(depth[box]), depth[box], np.float32(0.0)).astype(np.float32)
    ring = (cv2.dilate(part, np.ones((9, 9), np.uint8)) > 0) & (cv2.dilate(part, np.ones((5, 5), np.uint8)) == 0)
    with np.errstate(invalid="ignore"):
        nearer = ring & (depth[box] < cv2.dilate(own, np.ones((9, 9), np.uint8)) - 0.03)
    cut = int(mask[:, :2].any(axis=1).sum() + mask[:, -2:].any(axis=1).sum())
    cut += int(mask[:2].any(axis=0).sum() + mask[-2:].any(axis=0).sum())
    outline = float(np.count_nonzero(ring)) / 2.0 + cut
    return float(np.clip(2.5 * (0.5 * float(np.count_nonzero(nearer)) + cut) / max(outline, 1.0), 0.0, 1.0))


def _close(mask: Mask, box: tuple[slice, slice]) -> None:
    """Close the holes that missing depth leaves in a mask."""
    rows = slice(max(0, box[0].start - 4), box[0].stop + 4)
    columns = slice(max(0, box[1].start - 4), box[1].stop + 4)
    part = np.ascontiguousarray(mask[rows, columns]).view(np.uint8)
    part = cv2.morphologyEx(part, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    mask[rows, columns] = part.astype(bool)
