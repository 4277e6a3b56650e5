# SPDX-License-Identifier: Apache-2.0
"""From labelled surfaces to objects: fragments joined, hands and arms taken out, masks closed."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import RgbImage, lab_image
from uncom_perception.objects.attributes.scene_builder import mask_slices
from uncom_perception.objects.segments.arm_mask import hand_pixels
from uncom_perception.objects.segments.fill_by_colour import fill_by_colour
from uncom_perception.objects.segments.foreground import connected, foreground, mask_bounds, surfaces_of
from uncom_perception.objects.segments.join_fragments import join_fragments, join_hollow, parted_labels
from uncom_perception.objects.segments.on_table_filter import Reach, stands_on_table
from uncom_perception.objects.segments.options import OBJECT_MASKS, ObjectMaskOptions
from uncom_perception.objects.segments.regions import Box, regions_of
from uncom_perception.objects.segments.split_touching import split_touching
from uncom_perception.objects.segments.walls import without_walls
from uncom_perception.objects.table.table_outline import TopDown
from uncom_perception.objects.table.table_view import TableView
from uncom_perception.types import HandsFrame, Mask


def find_objects(
    image_rgb: RgbImage,
    view: TableView,
    hands: HandsFrame | None,
    gain: float = 1.0,
    *,
    options: ObjectMaskOptions = OBJECT_MASKS,
) -> list[tuple[Mask, Box]]:
    """Return one mask (H, W) for each object on the table, hands and arms left out, and rows and columns about it.

    A dim picture is looked at as if it were lighter by a gain.
    """
    table = TopDown(view.outline, options.follow_m)
    where = view.box_of(table)
    if where is None:
        return []
    pixels, apart = foreground(view.cut(where), table)
    bounds = mask_bounds(pixels)
    if bounds is None:
        return []
    inner = _widened(bounds, options.pad_px, pixels.shape)
    pixels, apart = np.ascontiguousarray(pixels[inner]), np.ascontiguousarray(apart[inner])
    rows, columns = part = _moved(inner, where)
    lab = lab_image(np.ascontiguousarray(image_rgb[part]), gain)
    surfaces = surfaces_of(view.cut(part), lab)
    if hands is not None:
        pixels &= ~hand_pixels(surfaces, pixels, hands, (columns.start, rows.start))
    regions = regions_of(connected(surfaces, pixels), options.speck_pixels)
    pixels, regions = without_walls(surfaces, pixels, regions, view.outline, options.speck_pixels)
    regions, origin = split_touching(surfaces, regions)
    regions, parted = join_fragments(surfaces, regions, parted_labels(surfaces, regions, origin, view.viewer))
    regions = join_hollow(surfaces, regions, parted, view.viewer)
    taken = regions.labels > 0
    reach = Reach(apart.ravel(), *options.margins_m)
    masks = []
    for label, box in regions.boxes().items():
        if stands_on_table(surfaces, regions, label, box, reach):
            mask = np.zeros(view.depth.shape, dtype=bool)
            window = mask[rows, columns]
            window[box] = regions.labels[box] == label
            _close(window, box)
            fill_by_colour(window, taken, surfaces.lab, box)
            masks.append((mask, mask_slices(mask, *_widened(_moved(box, part), options.closing_px, mask.shape))))
    return masks


def _widened(box: Box, by: int, shape: tuple[int, ...]) -> Box:
    """Return rows and columns wider by so many pixels, as far as the image goes."""
    rows, columns = (slice(max(0, s.start - by), min(s.stop + by, n)) for s, n in zip(box, shape, strict=True))
    return rows, columns


def _moved(box: Box, part: Box) -> Box:
    """Return rows and columns of a part of an image as those of the image."""
    rows, columns = (slice(p.start + s.start, p.start + s.stop) for p, s in zip(part, box, strict=True))
    return rows, columns


def hidden_share(mask: Mask, box: Box, depth: npt.NDArray[np.float32]) -> float:
    """Return how much of an object's outline is not its own: cut by the image's border or by something nearer, 0 to 1.

    The mask (H, W) lies within a box of rows and columns.
    """
    wide = tuple(slice(max(0, s.start - 5), s.stop + 5) for s in box)
    part, seen = np.ascontiguousarray(mask[wide]).view(np.uint8), depth[wide]
    own = np.where(part.view(bool) & (seen > 0.0), seen, np.float32(0.0))
    grown = cv2.dilate(part, np.ones((5, 5), np.uint8))
    ring = cv2.dilate(grown, np.ones((5, 5), np.uint8)) > grown
    v, u = np.nonzero(ring)
    nearer = seen[v, u] < cv2.dilate(own, np.ones((9, 9), np.uint8))[v, u] - np.float32(0.03)
    cut = 0
    border = OBJECT_MASKS.border_px
    if any(part.start <= border or part.stop > length - border for part, length in zip(box, mask.shape, strict=True)):
        cut += int(mask[:, :2].any(axis=1).sum() + mask[:, -2:].any(axis=1).sum())
        cut += int(mask[:2].any(axis=0).sum() + mask[-2:].any(axis=0).sum())
    outline = float(len(v)) / 2.0 + cut
    return min(1.0, 2.5 * (0.5 * float(np.count_nonzero(nearer)) + cut) / max(outline, 1.0))


def _close(mask: Mask, box: Box) -> None:
    """Close the holes that missing depth leaves in a mask."""
    rows = slice(max(0, box[0].start - 4), box[0].stop + 4)
    columns = slice(max(0, box[1].start - 4), box[1].stop + 4)
    part = np.ascontiguousarray(mask[rows, columns]).view(np.uint8)
    part = cv2.morphologyEx(part, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    mask[rows, columns] = part.astype(bool)
