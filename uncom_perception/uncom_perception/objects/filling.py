# SPDX-License-Identifier: Apache-2.0
"""Parts of a thing that the depth camera lost, found again by their colour.

Depth cameras see nothing, or the table, where a thing is dark, shiny or thin: the floor of a glazed bowl, a can's lid.
What lies within a thing's outline and has its colours, not those of the table about it, is part of it.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.types import Mask

_BIN = np.array([10.0, 7.0, 7.0], np.float32)  # of lightness, a and b
_SIZE = (12, 40, 40)
_MIN_GAP = 0.06  # of the mask's area: less is not worth a look
_RING = 13  # pixels about a thing whose colours are the table's
_LIKELIER = 3.0  # how much likelier than the table's the colour of a part has to be


def fill_by_colour(mask: Mask, taken: Mask, lab: npt.NDArray[np.float32], box: tuple[slice, slice]) -> None:
    """Add to a mask (H, W) what its convex outline in the image holds of its own colours, and no other thing has.

    Args:
        mask: of the thing; is changed.
        taken: pixels of all things.
        lab: the image in CIELAB.
        box: rows and columns of the mask.
    """
    rows = slice(max(0, box[0].start - _RING), box[0].stop + _RING)
    columns = slice(max(0, box[1].start - _RING), box[1].stop + _RING)
    own, others = mask[rows, columns], taken[rows, columns]
    part = np.ascontiguousarray(own).view(np.uint8)
    contours = cv2.findContours(part, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    hull = np.zeros_like(part)
    cv2.fillConvexPoly(hull, cv2.convexHull(np.concatenate(contours)), 1)
    gaps = hull.view(bool) & ~others & ~own
    area = int(np.count_nonzero(own))
    if np.count_nonzero(gaps) < _MIN_GAP * area:
        return
    ring = ~hull.view(bool) & ~others
    if np.count_nonzero(ring) < 50:
        return
    cells = np.clip(
        np.floor(lab[rows, columns] / _BIN).astype(np.int32) + np.array([0, 20, 20]), 0, np.array(_SIZE) - 1
    )
    code = (cells[..., 0] * _SIZE[1] + cells[..., 1]) * _SIZE[2] + cells[..., 2]
    inner = cv2.erode(part, np.ones((3, 3), np.uint8)).view(bool)
    mine, theirs = _frequencies(code[inner if np.count_nonzero(inner) > 50 else own]), _frequencies(code[ring])
    like = gaps & (mine > _LIKELIER * theirs)[code]
    found = cv2.morphologyEx(like.view(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) | part
    closed = cv2.morphologyEx(found, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)))
    labels = cv2.connectedComponents(closed, connectivity=4)[1]
    touched = np.zeros(int(labels.max()) + 1, bool)
    touched[labels[own]] = True
    mask[rows, columns] |= touched[labels] & hull.view(bool) & ~(others & ~own)


def _frequencies(codes: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
    counts = np.bincount(codes, minlength=_SIZE[0] * _SIZE[1] * _SIZE[2]).reshape(_SIZE).astype(np.float32)
    smooth = counts.copy()
    for axis in range(3):
        smooth += 0.5 * (np.roll(counts, 1, axis) + np.roll(counts, -1, axis))
    return np.asarray((smooth / max(len(codes), 1) + 1e-4).ravel(), dtype=float)
