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
from uncom_perception.objects.numbers import quantile
from uncom_perception.objects.segments import LabelImage, Surfaces, connected, label_boxes
from uncom_perception.types import Mask

_COLOUR_STEP = 5.5  # between neighbouring pixels [Lab, lightness at half weight]
_MIN_PATCH = 220  # pixels
_MIN_SHARE = 0.04  # of the surface
_FOLD = 0.22  # how concave a border must be [sine, about]
_SHARP_FOLD = 0.5  # where colour does not tell the two apart
_SOLID = 0.93  # share of its convex outline above which a surface is one thing
_SMALL_TOP_M = 0.045  # narrower things on top of others are their caps and lids
_APART_M = 0.02  # borders further apart than this stand one before the other
_SECTORS = 8
_REACH = 6  # pixels from the border to where surfaces are compared


def split_touching(surfaces: Surfaces, labels: LabelImage) -> tuple[LabelImage, npt.NDArray[np.int32]]:
    """Return labels in which things that meet in a fold have labels of their own, and which label each was (L + 1,)."""
    result = labels.copy()
    for label, box in label_boxes(labels).items():
        own = labels[box] == label
        if np.count_nonzero(own) < 3 * _MIN_PATCH:
            continue
        part = surfaces.cut(box)
        _relabel(result, box, own, _patches(part, own), part, _FOLD)
    for label, box in label_boxes(result).items():
        own = result[box] == label
        if np.count_nonzero(own) < 4 * _MIN_PATCH or _solidity(own) > _SOLID:
            continue
        part = surfaces.cut(box)
        normals = _normals(part.ground_points)
        _relabel(result, box, own, _convex_patches(part, own, normals), part, _SHARP_FOLD, normals)
    origin = np.zeros(int(result.max()) + 1, np.int32)
    origin[result.ravel()] = labels.ravel()
    return result, origin


def _relabel(
    labels: LabelImage,
    box: tuple[slice, slice],
    own: Mask,
    patches: LabelImage,
    part: Surfaces,
    fold: float,
    normals: npt.NDArray[np.float32] | None = None,
) -> None:
    """Give the patches of a surface that meet in a fold new labels."""
    if patches.max() < 2:
        return
    groups = _grouped(part, _normals(part.ground_points) if normals is None else normals, patches, fold)
    if int(np.ptp(groups[own])) > 0:
        labels[box][own] = int(labels.max()) + 1 + groups[own]


def _solidity(own: Mask) -> float:
    """Return the share that a surface has of its convex outline in the image."""
    contours = cv2.findContours(np.ascontiguousarray(own).view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    hull = cv2.convexHull(np.concatenate(contours))
    return float(np.count_nonzero(own)) / max(float(cv2.contourArea(hull)), 1.0)


def _convex_patches(part: Surfaces, own: Mask, normals: npt.NDArray[np.float32]) -> LabelImage:
    """Label the parts of one surface that no sharp fold runs through."""
    points = part.ground_points
    folded = np.zeros(own.shape, bool)
    for ahead, behind, middle in (
        (np.s_[:, 8:], np.s_[:, :-8], np.s_[:, 4:-4]),
        (np.s_[8:], np.s_[:-8], np.s_[4:-4]),
    ):
        apart = points[ahead] - points[behind]
        distance = np.sqrt(np.einsum("ijk,ijk->ij", apart, apart))
        bend = np.einsum("ijk,ijk->ij", normals[ahead] - normals[behind], apart) / np.maximum(distance, 1e-6)
        folded[middle] |= (bend < -_SHARP_FOLD) | (distance > 2.0 * _APART_M)
    # Surfaces bend away at their outlines; a bridge along there must not join what a fold parts.
    even = cv2.morphologyEx((own & ~folded).view(np.uint8), cv2.MORPH_ERODE, np.ones((5, 5), np.uint8))
    return _large(connected(part, even.view(bool)), own)


def _patches(part: Surfaces, own: Mask) -> LabelImage:
    """Label the patches of even colour of one surface; small ones take the label of what lies next to them."""
    lab = part.lab * np.array([0.5, 1.0, 1.0], np.float32)
    even = own.copy()
    for ahead, here in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        difference = lab[ahead] - lab[here]
        even[here] &= np.einsum("ijk,ijk->ij", difference, difference) < _COLOUR_STEP**2
    return _large(connected(part, even), own)


def _large(labels: LabelImage, own: Mask) -> LabelImage:
    """Keep the labels of patches that are large enough to be compared."""
    sizes = np.bincount(labels.ravel())
    keep = sizes >= max(_MIN_PATCH, _MIN_SHARE * np.count_nonzero(own))
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
    normal = np.empty_like(smooth)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        normal[..., i] = down[..., j] * along[..., k] - down[..., k] * along[..., j]
    length = np.sqrt(np.einsum("ijk,ijk->ij", normal, normal))
    normal /= np.maximum(length, np.float32(1e-12))[..., None]
    return np.asarray(normal, dtype=np.float32)


def _grouped(part: Surfaces, normals: npt.NDArray[np.float32], patches: LabelImage, least_fold: float) -> LabelImage:
    """Join patches again that do not meet in a fold; give every pixel the group of the nearest patch."""
    count = int(patches.max())
    parent = np.arange(count + 1)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _REACH + 1, 2 * _REACH + 1))
    zones = [cv2.dilate((patches == i).astype(np.uint8), kernel).astype(bool) for i in range(1, count + 1)]
    for i in range(1, count + 1):
        for j in range(i + 1, count + 1):
            near_i, near_j = (patches == i) & zones[j - 1], (patches == j) & zones[i - 1]
            if min(np.count_nonzero(near_i), np.count_nonzero(near_j)) < 20:
                continue
            if not _folded(part, normals, patches, (i, j), (near_i, near_j), least_fold):
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
    least_fold: float,
) -> bool:
    """Whether two patches meet concavely, or one stands before the other, and neither is a cap, a lid or a handle."""
    points = part.ground_points
    sizes = [int(np.count_nonzero(patches == i)) for i in pair]
    rows, columns = np.nonzero(patches == pair[int(sizes[1] < sizes[0])])
    middle = (float(rows.mean()), float(columns.mean()))
    (count_a, a, na), (count_b, b, nb) = (_sector_means(points, normals, zone, middle) for zone in near)
    folds, weights = [], []
    for sector in np.flatnonzero((count_a >= 6) & (count_b >= 6)):
        apart = a[sector] - b[sector]
        distance = float(np.linalg.norm(apart))
        fold = float((na[sector] - nb[sector]) @ apart) / max(distance, 1e-6)
        folds.append(-1.0 if distance > _APART_M else fold)
        weights.append(min(int(count_a[sector]), int(count_b[sector])))
    if not folds:
        return False
    order = np.argsort(folds)
    half = np.searchsorted(np.cumsum(np.array(weights)[order]), 0.5 * sum(weights))
    if folds[int(order[min(int(half), len(order) - 1)])] > -least_fold:
        return False
    for own, other in (pair, pair[::-1]):
        mine, theirs = points[patches == own], points[patches == other]
        if _is_fitting(mine, theirs):
            return False
    return True


def _sector_means(
    points: npt.NDArray[np.float32], normals: npt.NDArray[np.float32], zone: Mask, middle: tuple[float, float]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return counts, mean points and mean normals by sector about a place: borders are compared piece by piece."""
    v, u = np.nonzero(zone)
    sector = (np.arctan2(v - middle[0], u - middle[1]) / (2.0 * np.pi) * _SECTORS).astype(int) % _SECTORS
    count = np.bincount(sector, minlength=_SECTORS)
    means = []
    for values in (points[v, u], normals[v, u]):
        sums = [np.bincount(sector, weights=values[:, axis], minlength=_SECTORS) for axis in range(3)]
        means.append(np.column_stack(sums) / np.maximum(count, 1)[:, None])
    return count, means[0], means[1]


def _is_fitting(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32]) -> bool:
    """Whether a patch is a small top of another (cap, lid, stem) or a thin part held in the air by it (handle)."""
    length = max(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    low = quantile(mine[:, 2], 5)
    if low > quantile(theirs[:, 2], 80) and length < _SMALL_TOP_M:
        return True
    return is_handle(mine, theirs) or _is_floor(mine, theirs)


def _is_floor(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32]) -> bool:
    """Whether a patch lies, seen from above, within the rim of another: the inside of a hollow thing."""
    hull = cv2.convexHull(np.ascontiguousarray(theirs[:, :2]))
    middle = mine[:, :2].mean(axis=0)
    if cv2.pointPolygonTest(hull, (float(middle[0]), float(middle[1])), False) < 0:
        return False
    return quantile(mine[:, 2], 95) < quantile(theirs[:, 2], 95)


def _join(parent: npt.NDArray[np.int64], i: int, j: int) -> None:
    a, b = _find(parent, i), _find(parent, j)
    parent[max(a, b)] = min(a, b)


def _find(parent: npt.NDArray[np.int64], i: int) -> int:
    while parent[i] != i:
        i = int(parent[i])
    return i
