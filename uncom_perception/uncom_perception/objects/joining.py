# SPDX-License-Identifier: Apache-2.0
"""Joining the surfaces of one thing that holes in the depth, or its own shape, part in the image."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.objects.numbers import quantile
from uncom_perception.objects.segments import LabelImage, Surfaces, label_boxes

_CELL_M = 0.005
_FRAGMENT_PIXELS = 90
_SAME_LEVEL_M = 0.03
_HANDLE_GAP_M = 0.02
_BODY_M = 0.035
_TOP_M = 0.012
_TOP_WIDTH_M = 0.028


def join_fragments(surfaces: Surfaces, labels: LabelImage, origin: npt.NDArray[np.int32]) -> LabelImage:
    """Join surfaces of one thing that holes or its own shape part in the image: they meet seen from above.

    Front and inner back wall of a cup, say. Only surfaces of alike colour, or small fragments, are joined; not those
    that were parted at a fold, which have the same origin (L + 1,), if both are solid.
    """
    count = int(labels.max())
    if count < 2:
        return labels
    used = labels > 0
    flat = surfaces.ground_points[used]
    ids = labels[used]
    x, y = (np.floor(flat[:, axis] * np.float32(1.0 / _CELL_M) + np.float32(0.5)).astype(np.int64) for axis in (0, 1))
    x -= x.min() - 1
    width = int(x.max()) + 2
    key = (y - y.min() + 1) * width + x
    colours = _label_colours(surfaces, labels)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    both = key * (count + 1) + ids
    pairs, place = np.unique(both, return_inverse=True)
    level = np.bincount(place, weights=flat[:, 2]) / np.bincount(place)
    contacts = _contacts(pairs // (count + 1), pairs % (count + 1), level, width, count)
    parent = np.arange(count + 1)
    order = np.argwhere(np.triu(contacts) >= 2)
    for i, j in sorted(order.tolist(), key=lambda pair: -int(contacts[pair[0], pair[1]])):
        if origin[i] == origin[j] and all(_stands(surfaces.ground_points[labels == k]) for k in (i, j)):
            continue
        small = min(sizes[i - 1], sizes[j - 1]) < _FRAGMENT_PIXELS
        if small or (_alike(colours[i - 1], colours[j - 1]) and contacts[i, j] >= 4):
            a, b = _root(parent, i), _root(parent, j)
            parent[max(a, b)] = min(a, b)
    roots = np.array([_root(parent, i) for i in range(count + 1)])
    renumber = np.unique(roots, return_inverse=True)[1].astype(np.int32)
    return np.asarray(renumber[labels], dtype=np.int32)


def _contacts(
    cells: npt.NDArray[np.int64], ids: npt.NDArray[np.int64], level: npt.NDArray[np.float64], width: int, count: int
) -> npt.NDArray[np.int32]:
    """Count the neighbouring cells (sorted), seen from above, in which two labels lie at about the same height."""
    contacts = np.zeros((count + 1, count + 1), np.int32)
    for step in (0, 1, width, width + 1, width - 1):
        first, last = (np.searchsorted(cells, cells + step, side=side) for side in ("left", "right"))
        mine = np.repeat(np.arange(len(cells)), last - first)
        within = np.arange(len(mine)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
        other = first[mine] + within
        level_with = (ids[mine] != ids[other]) & (np.abs(level[mine] - level[other]) < _SAME_LEVEL_M)
        a, b = ids[mine[level_with]], ids[other[level_with]]
        np.add.at(contacts, (a, b), 1)
        np.add.at(contacts, (b, a), 1)
    return contacts


def _alike(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two Lab colours may be one surface in light and in shade, where chroma shrinks with lightness."""
    if abs(float(a[0] - b[0])) > 38.0:
        return False
    plain = float(np.hypot(*(a[1:] - b[1:])))
    relative = float(np.hypot(*(a[1:] / (a[0] + 12.0) - b[1:] / (b[0] + 12.0))))
    return plain < 14.0 or relative < 0.22


def join_hollow(surfaces: Surfaces, labels: LabelImage) -> LabelImage:
    """Join the front of a hollow thing and what is seen of its inside over the rim, where the rim itself was lost.

    Such surfaces border one another in the image, are alike in colour, and together are hardly longer than alone.
    """
    boxes = label_boxes(labels)
    if len(boxes) < 2:
        return labels
    kernel = np.ones((9, 9), np.uint8)
    corners: dict[int, npt.NDArray[np.float32]] = {}
    parent = np.arange(int(labels.max()) + 1)
    for i, box in boxes.items():
        rows = slice(max(0, box[0].start - 5), box[0].stop + 5)
        columns = slice(max(0, box[1].start - 5), box[1].stop + 5)
        part = labels[rows, columns]
        near = cv2.dilate((part == i).astype(np.uint8), kernel).astype(bool)
        counts = np.bincount(part[near])
        counts[[0, i]] = 0
        for j in np.flatnonzero(counts >= 12).tolist():
            if j > i or _root(parent, i) == _root(parent, j):
                continue
            facing = (part == i) & cv2.dilate((part == j).astype(np.uint8), kernel).astype(bool)
            seen = surfaces.ground_points[rows, columns]
            gap = np.linalg.norm(seen[facing].mean(axis=0) - seen[near & (part == j)].mean(axis=0))
            clouds = [surfaces.ground_points[boxes[k]][labels[boxes[k]] == k] for k in (i, j)]
            if gap < _HANDLE_GAP_M and (is_handle(*clouds) or is_handle(*clouds[::-1])):
                a, b = _root(parent, i), _root(parent, j)
                parent[max(a, b)] = min(a, b)
                continue
            lab = surfaces.lab[rows, columns]
            if _alike(np.median(lab[facing], axis=0), np.median(lab[near & (part == j)], axis=0)):
                hulls = [corners.setdefault(k, _hull(surfaces, labels, k, boxes[k])) for k in (i, j)]
                if _one_body(*hulls) and not (_has_top(clouds[0]) and _has_top(clouds[1])):
                    a, b = _root(parent, i), _root(parent, j)
                    parent[max(a, b)] = min(a, b)
    roots = np.array([_root(parent, i) for i in range(len(parent))])
    return np.asarray(np.unique(roots, return_inverse=True)[1].astype(np.int32)[labels], dtype=np.int32)


def is_handle(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32]) -> bool:
    """Whether points (N, 3) are a long thin part in the air, which the thing beside it must hold."""
    if quantile(mine[:, 2], 5) < 0.02 or len(theirs) < 2 * len(mine):
        return False
    width, length = sorted(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    hull = cv2.convexHull(np.ascontiguousarray(theirs[:, :2]))
    middle = mine[:, :2].mean(axis=0)
    if width > 0.05 or length < 2.0 * width or quantile(mine[:, 2], 95) > 0.12:
        return False
    gap = -cv2.pointPolygonTest(hull, (float(middle[0]), float(middle[1])), True)
    return bool(0.0 < gap < 0.5 * length + 0.03)


def _hull(surfaces: Surfaces, labels: LabelImage, label: int, box: tuple[slice, slice]) -> npt.NDArray[np.float32]:
    flat = surfaces.ground_points[box][labels[box] == label][:, :2]
    return np.asarray(cv2.convexHull(np.ascontiguousarray(flat, dtype=np.float32))[:, 0], dtype=np.float32)


def _one_body(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two outlines seen from above are parts of one compact thing."""
    sides = [cv2.minAreaRect(hull)[1] for hull in (a, b, np.concatenate([a, b]))]
    longest = max(*sides[0], *sides[1])
    return bool(max(sides[2]) < 1.15 * longest + 0.006 and min(sides[2]) > 0.5 * min(longest, 0.25))


def _has_top(points: npt.NDArray[np.float32]) -> bool:
    """Whether points (N, 3) end in a surface seen from above, as solid things do, and not in a rim."""
    high = points[points[:, 2] > quantile(points[:, 2], 98) - _TOP_M]
    hull = cv2.convexHull(np.ascontiguousarray(high[:, :2]))
    if len(high) < 10 or min(cv2.minAreaRect(hull)[1]) < _TOP_WIDTH_M:
        return False
    column, row = (np.floor(high[:, axis] / np.float32(_CELL_M)).astype(np.int64) for axis in (0, 1))
    cells = len(np.unique(column * 100_000 + row))
    return bool(cells * _CELL_M**2 > 0.6 * float(cv2.contourArea(hull)))


def _stands(points: npt.NDArray[np.float32]) -> bool:
    """Whether points (N, 3) are a solid body with a top of its own."""
    return len(points) >= _FRAGMENT_PIXELS and quantile(points[:, 2], 98) > _BODY_M and _has_top(points)


def _label_colours(surfaces: Surfaces, labels: LabelImage) -> npt.NDArray[np.float32]:
    """Return the median Lab colour of each label from 1 on."""
    colours = np.zeros((int(labels.max()), 3), np.float32)
    for label, box in label_boxes(labels).items():
        own = surfaces.lab[box][labels[box] == label]
        colours[label - 1] = np.median(own[:: max(1, len(own) // 400)], axis=0)
    return colours


def _root(parent: npt.NDArray[np.int64], i: int) -> int:
    while parent[i] != i:
        i = int(parent[i])
    return i
