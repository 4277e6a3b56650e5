# SPDX-License-Identifier: Apache-2.0
"""Things that touch: told apart where their colours meet in a fold.

Colour alone splits a box at its print, shape alone a pan at its handle; together they tell an apple from the box that
it leans on, and a lemon from the bowl that it lies in (after the locally convex patches of Stein et al., 2014).
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.joining import is_handle
from uncom_perception.objects.segments import LabelImage, Surfaces, connected, label_boxes
from uncom_perception.types import Mask

_COLOUR_STEP = 5.5  # between neighbouring pixels [Lab, lightness at half weight]
_MIN_PATCH = 220  # pixels
_MIN_SHARE = 0.04  # of the surface
_FOLD = 0.22  # how concave a border must be [sine, about]
_SMALL_TOP_M = 0.045  # narrower things on top of others are their caps and lids
_APART_M = 0.02  # borders further apart than this stand one before the other
_SECTORS = 8
_REACH = 6  # pixels from the border to where surfaces are compared


def split_touching(surfaces: Surfaces, labels: LabelImage) -> LabelImage:
    """Return labels in which differently coloured things that meet in a fold have labels of their own."""
    result = labels.copy()
    following = int(labels.max()) + 1
    for label, box in label_boxes(labels).items():
        own = labels[box] == label
        if own.sum() < 3 * _MIN_PATCH:
            continue
        part = _cut(surfaces, box)
        patches = _patches(part, own)
        if patches.max() < 2:
            continue
        groups = _grouped(part, _normals(part.ground_points), patches)
        for group in range(1, int(groups.max()) + 1):
            result[box][own & (groups == group)] = following
            following += 1
    return result


def _cut(surfaces: Surfaces, box: tuple[slice, slice]) -> Surfaces:
    return Surfaces(surfaces.ground_points[box], surfaces.lab[box], surfaces.sigma_m, surfaces.pixel_m)


def _patches(part: Surfaces, own: Mask) -> LabelImage:
    """Label the patches of even colour of one surface; small ones take the label of what lies next to them."""
    lab = part.lab * np.array([0.5, 1.0, 1.0], np.float32)
    step = np.zeros(own.shape, np.float32)
    for axis in (0, 1):
        ahead = np.linalg.norm(np.diff(lab, n=1, axis=axis), axis=2)
        pad = [(0, 1), (0, 0)] if axis == 0 else [(0, 0), (0, 1)]
        step = np.maximum(step, np.pad(ahead, pad))
    even = own & (step < _COLOUR_STEP)
    labels = connected(part, even)
    sizes = np.bincount(labels.ravel())
    keep = sizes >= max(_MIN_PATCH, _MIN_SHARE * own.sum())
    keep[0] = False
    renumber = np.zeros(len(sizes), np.int32)
    renumber[keep] = np.arange(1, keep.sum() + 1)
    return np.asarray(renumber[labels], dtype=np.int32)


def _normals(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return unit normals (H, W, 3) of the surfaces, towards above or the camera, over windows of 9 pixels."""
    known = np.isfinite(points[..., 2])
    weight = np.maximum(cv2.blur(known.astype(np.float32), (5, 5)), 1e-3)[..., None]
    smooth = cv2.blur(np.where(known[..., None], points, np.float32(0.0)), (5, 5)) / weight
    along = np.zeros_like(smooth)
    down = np.zeros_like(smooth)
    along[:, 3:-3] = smooth[:, 6:] - smooth[:, :-6]
    down[3:-3] = smooth[6:] - smooth[:-6]
    normal = np.cross(down, along)
    length = np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    return np.asarray(normal / length, dtype=np.float32)


def _grouped(part: Surfaces, normals: npt.NDArray[np.float32], patches: LabelImage) -> LabelImage:
    """Join patches again that do not meet in a fold; give every pixel the group of the nearest patch."""
    count = int(patches.max())
    parent = np.arange(count + 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _REACH + 1, 2 * _REACH + 1))
    zones = [cv2.dilate((patches == i).astype(np.uint8), kernel).astype(bool) for i in range(1, count + 1)]
    for i in range(1, count + 1):
        for j in range(i + 1, count + 1):
            near_i, near_j = (patches == i) & zones[j - 1], (patches == j) & zones[i - 1]
            if min(near_i.sum(), near_j.sum()) < 20:
                continue
            if not _folded(part, normals, patches, (i, j), (near_i, near_j)):
                _join(parent, i, j)
    groups = np.array([_find(parent, i) for i in range(count + 1)])
    _, nearest = cv2.distanceTransformWithLabels(
        (patches == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    seeds = np.zeros(int(nearest.max()) + 1, np.int32)
    seeds[nearest[patches > 0]] = groups[patches[patches > 0]]
    _, dense = np.unique(seeds[nearest], return_inverse=True)
    return np.asarray(dense.reshape(patches.shape), dtype=np.int32)


def _folded(
    part: Surfaces,
    normals: npt.NDArray[np.float32],
    patches: LabelImage,
    pair: tuple[int, int],
    near: tuple[Mask, Mask],
) -> bool:
    """Whether two patches meet concavely, or one stands before the other, and neither is a cap, a lid or a handle."""
    points = part.ground_points
    smaller = patches == min(pair, key=lambda i: int((patches == i).sum()))
    rows, columns = np.nonzero(smaller)
    sectors = _sectors(patches.shape, float(rows.mean()), float(columns.mean()))
    folds, weights = [], []
    for sector in range(_SECTORS):
        here = [m & (sectors == sector) for m in near]
        if min(m.sum() for m in here) < 6:
            continue
        a, b = (points[m].mean(axis=0) for m in here)
        na, nb = (normals[m].mean(axis=0) for m in here)
        distance = float(np.linalg.norm(a - b))
        folds.append(-1.0 if distance > _APART_M else float((na - nb) @ (a - b)) / max(distance, 1e-6))
        weights.append(min(int(m.sum()) for m in here))
    if not folds:
        return False
    order = np.argsort(folds)
    middle = np.searchsorted(np.cumsum(np.array(weights)[order]), 0.5 * sum(weights))
    if folds[int(order[min(int(middle), len(order) - 1)])] > -_FOLD:
        return False
    for own, other in (pair, pair[::-1]):
        mine, theirs = points[patches == own], points[patches == other]
        if _is_fitting(mine, theirs):
            return False
    return True


def _sectors(shape: tuple[int, ...], row: float, column: float) -> npt.NDArray[np.int32]:
    """Return in which sector about a place each pixel lies: borders are compared piece by piece, not on average."""
    v, u = np.mgrid[0 : shape[0], 0 : shape[1]]
    return np.asarray((np.arctan2(v - row, u - column) / (2.0 * np.pi) * _SECTORS) % _SECTORS, dtype=np.int32)


def _is_fitting(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32]) -> bool:
    """Whether a patch is a small top of another (cap, lid, stem) or a thin part held in the air by it (handle)."""
    length = max(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    low = float(np.percentile(mine[:, 2], 5))
    if low > np.percentile(theirs[:, 2], 80) and length < _SMALL_TOP_M:
        return True
    return is_handle(mine, theirs)


def _join(parent: npt.NDArray[np.int64], i: int, j: int) -> None:
    a, b = _find(parent, i), _find(parent, j)
    parent[max(a, b)] = min(a, b)


def _find(parent: npt.NDArray[np.int64], i: int) -> int:
    while parent[i] != i:
        i = int(parent[i])
    return i
