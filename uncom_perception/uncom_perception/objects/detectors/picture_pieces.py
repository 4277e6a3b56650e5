# SPDX-License-Identifier: Apache-2.0
"""Pieces of a plain picture that are one object each: apart by place, then by colour, and out over the table's edge."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from uncom_perception.objects.detectors.options import PICTURE_PIECES, PicturePieceOptions
from uncom_perception.types import Mask

LabImage = npt.NDArray[np.float32]

_OPENING = np.ones((3, 3), np.uint8)
_SMOOTH = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))


def pieces_of(
    objects: Mask,
    region: Mask,
    rgb: npt.NDArray[np.uint8],
    lab: LabImage,
    *,
    options: PicturePieceOptions = PICTURE_PIECES,
) -> list[Mask]:
    """Return one mask (H, W) an object, from what in a table's region (H, W) has not its colour; the largest first."""
    around = np.ones((2 * options.edge_px + 1,) * 2, np.uint8)
    inner = (
        cv2.erode(np.pad(region, options.edge_px).astype(np.uint8), around)[
            options.edge_px : -options.edge_px, options.edge_px : -options.edge_px
        ]
        > 0
    )
    opened = cv2.morphologyEx((objects & inner).astype(np.uint8), cv2.MORPH_OPEN, _OPENING)
    labels, _ = ndimage.label(opened)
    found: list[Mask] = []
    for i, box in enumerate(ndimage.find_objects(labels), start=1):
        window = _wider(box, options.edge_px + 1, objects.shape)
        own = labels[window] == i
        if np.count_nonzero(own) < 0.5 * options.least_area_share * objects.size:
            continue
        free = objects[window] & ((labels[window] == 0) | own)
        grown = (cv2.dilate(own.astype(np.uint8), around) > 0) & free
        grown = ndimage.binary_fill_holes(cv2.morphologyEx(grown.astype(np.uint8), cv2.MORPH_OPEN, _SMOOTH))
        for part in _by_hue(np.asarray(grown, dtype=bool), lab[window], options=options):
            if _is_thing(part, objects.size, options=options):
                whole = np.zeros(objects.shape, dtype=bool)
                whole[window] = part
                found.append(whole)
    taken, kept = np.zeros_like(objects), []
    for mask in sorted(found, key=np.count_nonzero, reverse=True):
        if np.count_nonzero(mask & taken) < 0.5 * np.count_nonzero(mask):  # else it is print on a larger object
            kept.append(mask)
            taken |= mask
    return [_beyond(mask, region, taken & ~mask, rgb, options=options) for mask in kept]


def _wider(box: tuple[slice, ...], by: int, shape: tuple[int, ...]) -> tuple[slice, slice]:
    rows, columns = (slice(max(0, s.start - by), min(n, s.stop + by)) for s, n in zip(box, shape, strict=True))
    return rows, columns


def _is_thing(mask: Mask, size: int, *, options: PicturePieceOptions = PICTURE_PIECES) -> bool:
    """Tell specks and the slivers along an edge from objects, in a picture of so many pixels."""
    area = int(np.count_nonzero(mask))
    if not options.least_area_share * size < area < options.most_area_share * size:
        return False
    thickness = 2.0 * float(cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 3).max())
    return thickness > options.thin_px or area > 0.5 * _solid_area(mask)


def _solid_area(mask: Mask) -> float:
    contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return float(cv2.contourArea(cv2.convexHull(np.concatenate(contours))))


def _by_hue(mask: Mask, lab: LabImage, depth: int = 3, *, options: PicturePieceOptions = PICTURE_PIECES) -> list[Mask]:
    """Part a mask where two colourful hues, each in one piece, meet: objects that touch in the picture."""
    chroma = lab[..., 1:]
    colourful = mask & (np.hypot(chroma[..., 0], chroma[..., 1]) > options.colourful)
    if depth == 0 or np.count_nonzero(colourful) <= max(
        2.0 * options.inner_object_share * np.count_nonzero(mask), 50.0
    ):
        return [mask]
    values = chroma[colourful]
    values = np.ascontiguousarray(values / np.linalg.norm(values, axis=1, keepdims=True), np.float32)
    start = (values @ _main_axis(values) > 0.0).astype(np.int32).reshape(-1, 1)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 10, 0.01)
    _, which, middles = cv2.kmeans(values, 2, start, criteria, 1, cv2.KMEANS_USE_INITIAL_LABELS)
    apart = np.abs(np.angle(complex(*middles[0]) / complex(*middles[1])))
    if apart < options.other_hue_rad:
        return [mask]
    hues = np.zeros(mask.shape, np.uint8)
    hues[colourful] = which.ravel().astype(np.uint8) + 1
    cores = [_core(hues == k, options=options) for k in (1, 2)]
    if any(np.count_nonzero(core) < options.inner_object_share * np.count_nonzero(mask) for core in cores):
        return [mask]
    nearer = [cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, 3) for core in cores]
    first = mask & (nearer[0] <= nearer[1])
    return [part for half in (first, mask & ~first) for part in _by_hue(half, lab, depth - 1, options=options)]


def _main_axis(values: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the direction (2,) in which unit vectors (N, 2) differ most from their mean, with which it is signed."""
    mean = values.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((values - mean).T))
    return np.asarray(axes[:, -1], np.float32)


def _core(mask: Mask, *, options: PicturePieceOptions = PICTURE_PIECES) -> Mask:
    """Return the largest piece of a mask, or nothing where it is scattered."""
    labels, count = ndimage.label(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _OPENING))
    if count == 0:
        return np.zeros_like(mask)
    sizes = np.bincount(labels.ravel())[1:]
    if sizes.max() < options.connected_share * np.count_nonzero(mask):
        return np.zeros_like(mask)
    return np.asarray(labels == 1 + int(sizes.argmax()), dtype=bool)


def _beyond(
    mask: Mask, region: Mask, others: Mask, rgb: npt.NDArray[np.uint8], *, options: PicturePieceOptions = PICTURE_PIECES
) -> Mask:
    """Follow an object over the table's edge by its colours (GrabCut, Rother et al. 2004), or return it as it is."""
    crossing = (
        (cv2.dilate(mask.astype(np.uint8), np.ones((2 * options.edge_px + 1, 1), np.uint8)) > 0) & ~region & ~others
    )
    if np.count_nonzero(crossing.any(axis=0)) < options.least_crossing_px:
        return mask
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    height, width = rows[-1] - rows[0] + 1, columns[-1] - columns[0] + 1
    by, far = int(0.5 * width) + 8, int(options.beyond_edge_heights * max(height, width))
    above, below = (half.any() for half in np.split(crossing, [int(rows.mean())]))
    window = (
        slice(max(0, rows[0] - far * int(above)), rows[-1] + 1 + far * int(below)),
        slice(max(0, columns[0] - by), columns[-1] + by),
    )
    own, out = mask[window], ~region[window] & ~others[window]
    guess = np.full(own.shape, cv2.GC_BGD, np.uint8)
    guess[out] = cv2.GC_PR_BGD
    guess[out & crossing[window].any(axis=0)] = cv2.GC_PR_FGD
    guess[own] = cv2.GC_FGD
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(rgb[window], guess, None, models[0], models[1], 3, cv2.GC_INIT_WITH_MASK)
    labels, _ = ndimage.label((guess == cv2.GC_FGD) | (guess == cv2.GC_PR_FGD))
    kept = np.isin(labels, np.unique(labels[own & (labels > 0)])) & (labels > 0)
    runs_off = kept[:, 0].any() or kept[:, -1].any()  # it is the wall that was followed
    if runs_off or np.count_nonzero(kept) > 4 * np.count_nonzero(own):
        return mask
    grown = mask.copy()
    grown[window] |= kept
    return grown
