# SPDX-License-Identifier: Apache-2.0
"""Parts of an object that the depth camera lost, found again by their colour.

Depth cameras see nothing, or the table, where an object is dark, shiny or thin, as the floor of a glazed bowl.
What lies within an object's outline and has its colours, not those of the table about it, is part of it.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.options import COLOUR_FILL, ColourFillOptions
from uncom_perception.types import Mask


def fill_by_colour(
    mask: Mask,
    taken: Mask,
    lab: npt.NDArray[np.float32],
    box: tuple[slice, slice],
    *,
    options: ColourFillOptions = COLOUR_FILL,
) -> None:
    """Add to a mask (H, W) what its convex outline in the image holds of its own colours, and no other object has.

    Args:
        options: numbers that tune it.
        mask: of the object; is changed.
        taken: pixels of all objects.
        lab: the image in CIELAB.
        box: rows and columns of the mask.
    """
    rows = slice(max(0, box[0].start - options.ring_px), box[0].stop + options.ring_px)
    columns = slice(max(0, box[1].start - options.ring_px), box[1].stop + options.ring_px)
    own, others = mask[rows, columns], taken[rows, columns]
    part = np.ascontiguousarray(own).view(np.uint8)
    contours = cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    hull = np.zeros_like(part)
    cv2.fillConvexPoly(hull, cv2.convexHull(np.concatenate(contours)), 1)
    gaps = hull.view(bool) & ~others & ~own
    area = int(np.count_nonzero(own))
    if np.count_nonzero(gaps) < options.least_gap_share * area:
        return
    ring = ~hull.view(bool) & ~others
    if np.count_nonzero(ring) < options.least_ring_px:
        return
    inner = cv2.erode(part, np.ones((3, 3), np.uint8)).view(bool)
    window = lab[rows, columns]
    asked, ours = (
        _codes(window[gaps], options=options),
        _codes(window[inner if np.count_nonzero(inner) > options.least_inner_px else own], options=options),
    )
    theirs = _codes(window[::2, ::2][ring[::2, ::2]], options=options)
    like = np.zeros_like(part)
    like[gaps] = _frequencies(ours, asked, options=options) > options.likelihood_ratio * _frequencies(
        theirs, asked, options=options
    )
    if not like.any():
        return
    found = cv2.morphologyEx(like, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) | part
    closed = cv2.morphologyEx(found, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    labels = cv2.connectedComponents(closed, connectivity=4)[1]
    touched = np.zeros(int(labels.max()) + 1, bool)
    touched[labels[own]] = True
    mask[rows, columns] |= touched[labels] & hull.view(bool) & ~(others & ~own)


def _codes(lab: npt.NDArray[np.float32], *, options: ColourFillOptions = COLOUR_FILL) -> npt.NDArray[np.int32]:
    """Return the number of the cell in colour space that each colour (N, 3) lies in."""
    cells = [
        np.clip((lab[:, k] * np.float32(1.0 / width) + np.float32(middle)).astype(np.int32), 0, most - 1)
        for k, (width, middle, most) in enumerate(
            zip(options.bin_widths, options.black_cell, options.bins, strict=True)
        )
    ]
    return np.asarray((cells[0] * options.bins[1] + cells[1]) * options.bins[2] + cells[2])


def _frequencies(
    codes: npt.NDArray[np.int32], asked: npt.NDArray[np.int32], *, options: ColourFillOptions = COLOUR_FILL
) -> npt.NDArray[np.float32]:
    """Return how frequent colours like those asked for are among others."""
    margin = options.bins[1] * options.bins[2]
    counts = np.bincount(codes + margin, minlength=(options.bins[0] + 2) * margin).astype(np.float32)
    around = [counts[asked + margin + step] for step in (1, -1, options.bins[2], -options.bins[2], margin, -margin)]
    return np.asarray((counts[asked + margin] + np.float32(0.5) * sum(around)) / max(len(codes), 1) + 1e-4, np.float32)
