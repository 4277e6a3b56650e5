# SPDX-License-Identifier: Apache-2.0
"""Joining the surfaces of one thing that holes in the depth, or its own shape, part in the image."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from uncom_perception.objects.numbers import quantile
from uncom_perception.objects.segments import LabelImage, Surfaces, label_boxes
from uncom_perception.objects.shape import body_sides
from uncom_perception.types import Mask

_CELL_M = 0.005
_FRAGMENT_PIXELS = 90
_SAME_LEVEL_M = 0.03
_HANDLE_GAP_M = 0.02
_BODY_M = 0.035
_WITHIN = 0.7  # share of a floor that lies within the rim, seen from above
_WITHIN_ALIKE = 0.45  # likewise where their colours are alike: part of the rim may be hidden
_HOLDS, _HOLDS_ALIKE = 2.0, 0.15  # seen of a thing, over what is seen of its handle
_FLOOR_M, _BESIDE_SHARE = 0.02, 0.25
_LEAST_HANDLE_M = 0.025  # a shorter one is no reason to look twice
_HIGHEST_HANDLE_M = 0.12
_RIM_M = 0.025  # inside and outside of a hollow thing end at one rim
_TOP_M = 0.012
_TOP_WIDTH_M = 0.028


class _Groups:
    """Labels that are joined step by step, but never two that were parted, nor what each of them is joined with."""

    def __init__(self, parted: Mask) -> None:
        """Begin with one group a label; parted (L + 1, L + 1) tells which labels are two things."""
        self.parted = parted.copy()
        self._parent = np.arange(len(parted))

    def root(self, i: int) -> int:
        while self._parent[i] != i:
            i = int(self._parent[i])
        return i

    def join(self, i: int, j: int) -> bool:
        """Join two groups, unless they are parted or one already."""
        a, b = self.root(i), self.root(j)
        if a == b or self.parted[a, b]:
            return False
        a, b = min(a, b), max(a, b)
        self._parent[b] = a
        self.parted[a] |= self.parted[b]
        self.parted[:, a] |= self.parted[:, b]
        return True

    def renumbered(self, labels: LabelImage) -> tuple[LabelImage, Mask]:
        """Return the groups as labels, and which of those are parted."""
        roots = np.array([self.root(i) for i in range(len(self._parent))])
        kept, numbers = np.unique(roots, return_inverse=True)
        return np.asarray(numbers.reshape(-1).astype(np.int32)[labels], np.int32), self.parted[np.ix_(kept, kept)]


def parted_labels(surfaces: Surfaces, labels: LabelImage, origin: npt.NDArray[np.int32]) -> Mask:
    """Return which labels (L + 1, L + 1) were parted at a fold: those of one origin (L + 1,) that are large enough.

    Inside and outside of a hollow thing are parted only until they are seen to be of one colour, and one of them to
    have no top of its own.
    """
    sizes = np.bincount(labels.ravel(), minlength=len(origin))
    large = sizes >= _FRAGMENT_PIXELS
    parted = (origin[:, None] == origin[None]) & large[:, None] & large[None]
    np.fill_diagonal(parted, False)
    parted[0] = parted[:, 0] = False
    if not parted.any():
        return np.asarray(parted)
    colours = _label_colours(surfaces, labels)
    clouds: dict[int, npt.NDArray[np.float32]] = {}
    for i, j in np.argwhere(np.triu(parted)).tolist():
        if not alike_colours(colours[i - 1], colours[j - 1]):
            continue
        one, other = (clouds.setdefault(k, surfaces.ground_points[labels == k]) for k in (i, j))
        parted[i, j] = parted[j, i] = not _may_be_hollow(one, other)
    return np.asarray(parted)


def _may_be_hollow(one: npt.NDArray[np.float32], other: npt.NDArray[np.float32]) -> bool:
    """Whether points (N, 3) and (M, 3) may be inside and outside of one thing."""
    if _stands(one) and _stands(other):
        return False
    level = abs(quantile(one[:, 2], 98) - quantile(other[:, 2], 98)) < _RIM_M
    return level or is_floor(one, other, alike=True) or is_floor(other, one, alike=True)


def join_fragments(surfaces: Surfaces, labels: LabelImage, parted: Mask) -> tuple[LabelImage, Mask]:
    """Join surfaces of one thing that holes or its own shape part in the image: they meet seen from above.

    Front and inner back wall of a cup, say. Only surfaces of alike colour, or small fragments, are joined; not those
    that are parted (L + 1, L + 1).
    """
    count = int(labels.max())
    if count < 2:
        return labels, parted
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
    groups = _Groups(parted)
    order = np.argwhere(np.triu(contacts) >= 4)
    small = np.concatenate([[True], sizes < _FRAGMENT_PIXELS])
    for i, j in sorted(order.tolist(), key=lambda pair: -int(contacts[pair[0], pair[1]])):
        if not (small[i] or small[j]) and alike_colours(colours[i - 1], colours[j - 1]):
            groups.join(i, j)
    # A fragment belongs to one thing; it is no bridge between two.
    for i in (np.flatnonzero(small[1:]) + 1).tolist():
        nearest = int(contacts[i].argmax())
        if contacts[i, nearest] >= 2:
            groups.join(i, nearest)
    return groups.renumbered(labels)


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


def alike_colours(a: npt.NDArray[np.floating], b: npt.NDArray[np.floating]) -> bool:
    """Whether two Lab colours may be one surface in light and in shade, where chroma shrinks with lightness."""
    if abs(float(a[0] - b[0])) > 38.0:
        return False
    plain = float(np.hypot(*(a[1:] - b[1:])))
    relative = float(np.hypot(*(a[1:] / (a[0] + 12.0) - b[1:] / (b[0] + 12.0))))
    return plain < 14.0 or relative < 0.22


def join_hollow(surfaces: Surfaces, labels: LabelImage, parted: Mask) -> tuple[LabelImage, Mask]:
    """Join the front of a hollow thing and what is seen of its inside over the rim, where the rim itself was lost.

    Such surfaces border one another in the image, are alike in colour, and together are hardly longer than alone; they
    are not parted (L + 1, L + 1).
    """
    boxes = label_boxes(labels)
    if len(boxes) < 2:
        return labels, parted
    kernel = np.ones((9, 9), np.uint8)
    corners: dict[int, npt.NDArray[np.float32]] = {}
    fitting: list[tuple[float, int, int]] = []
    for i, box in boxes.items():
        rows = slice(max(0, box[0].start - 5), box[0].stop + 5)
        columns = slice(max(0, box[1].start - 5), box[1].stop + 5)
        part = labels[rows, columns]
        near = cv2.dilate((part == i).astype(np.uint8), kernel).astype(bool)
        counts = np.bincount(part[near])
        counts[[0, i]] = 0
        for j in np.flatnonzero(counts >= 12).tolist():
            if j > i or parted[i, j]:
                continue
            facing = (part == i) & cv2.dilate((part == j).astype(np.uint8), kernel).astype(bool)
            seen = surfaces.ground_points[rows, columns]
            gap = np.linalg.norm(seen[facing].mean(axis=0) - seen[near & (part == j)].mean(axis=0))
            clouds = [surfaces.ground_points[boxes[k]][labels[boxes[k]] == k] for k in (i, j)]
            if gap < _HANDLE_GAP_M and (is_handle(*clouds) or is_handle(*clouds[::-1])):
                fitting.append((-1.0, i, j))
                continue
            lab = surfaces.lab[rows, columns]
            mine, theirs = (np.median(lab[facing], axis=0), np.median(lab[near & (part == j)], axis=0))
            if alike_colours(mine, theirs):
                hulls = [corners.setdefault(k, _hull(surfaces, labels, k, boxes[k])) for k in (i, j)]
                compact = _one_body(*hulls) or _held_by(*clouds) or _held_by(*clouds[::-1])
                if compact and not (_has_top(clouds[0]) and _has_top(clouds[1])):
                    fitting.append((float(np.linalg.norm(mine - theirs)), i, j))
    groups = _Groups(parted)
    for _, i, j in sorted(fitting):
        groups.join(i, j)
    return groups.renumbered(labels)


def is_handle(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, alike: bool = False) -> bool:
    """Whether points (N, 3) are a long thin part in the air, which the thing beside it must hold.

    Of that thing as much must be seen, or a part if their colours are alike.
    """
    least = _HOLDS_ALIKE if alike else _HOLDS
    if quantile(mine[:, 2], 5) < 0.02 or len(theirs) < least * len(mine):
        return False
    width, length = sorted(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    hull = cv2.convexHull(np.ascontiguousarray(theirs[:, :2]))
    middle = mine[:, :2].mean(axis=0)
    if width > 0.05 or length < 2.0 * width or quantile(mine[:, 2], 95) > _HIGHEST_HANDLE_M:
        return False
    gap = -cv2.pointPolygonTest(hull, (float(middle[0]), float(middle[1])), True)
    return bool(0.0 < gap < 0.5 * length + 0.03)


def is_floor(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, alike: bool = False) -> bool:
    """Whether points (N, 3) lie, seen from above, within the rim of others (M, 3): the inside of a hollow thing.

    If their colours are alike, part of the rim may be hidden: the floor of a pan, which its wall rises beside.
    """
    if quantile(mine[:, 2], 95) >= quantile(theirs[:, 2], 95):
        return False
    if _share_within(mine, theirs) >= (_WITHIN_ALIKE if alike else _WITHIN):
        return True
    low = quantile(mine[:, 2], 95) < _FLOOR_M and quantile(theirs[:, 2], 5) < 1.5 * _FLOOR_M
    shallow = quantile(theirs[:, 2], 95) < _HIGHEST_HANDLE_M
    return alike and low and shallow and _share_within(theirs, mine) < _BESIDE_SHARE


def _share_within(points: npt.NDArray[np.float32], others: npt.NDArray[np.float32]) -> float:
    """Return the share of points (N, 3) within the convex outline of others (M, 3), seen from above."""
    hull = cv2.convexHull(np.ascontiguousarray(others[:, :2]))[:, 0].astype(float)
    if len(hull) < 3:
        return 0.0
    some = points[:: max(1, len(points) // 200), :2]
    return float(shapely.contains_xy(Polygon(hull), some[:, 0], some[:, 1]).mean())


def _hull(surfaces: Surfaces, labels: LabelImage, label: int, box: tuple[slice, slice]) -> npt.NDArray[np.float32]:
    flat = surfaces.ground_points[box][labels[box] == label][:, :2]
    return np.asarray(cv2.convexHull(np.ascontiguousarray(flat, dtype=np.float32))[:, 0], dtype=np.float32)


def _one_body(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> bool:
    """Whether two outlines seen from above are parts of one compact thing."""
    sides = [cv2.minAreaRect(hull)[1] for hull in (a, b, np.concatenate([a, b]))]
    longest = max(*sides[0], *sides[1])
    return bool(max(sides[2]) < 1.15 * longest + 0.006 and min(sides[2]) > 0.5 * min(longest, 0.25))


def _held_by(mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32]) -> bool:
    """Whether points (N, 3) are a handle and a part of the body that it is on, of which the others (M, 3) are, too."""
    (long_side, short_side), handle = body_sides(np.concatenate([mine, theirs]))
    sides = cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(theirs[:, :2])))[1]
    return bool(
        handle > _LEAST_HANDLE_M
        and long_side < 1.15 * max(sides) + 0.006
        and short_side > 0.5 * max(sides)
        and max(quantile(mine[:, 2], 95), quantile(theirs[:, 2], 95)) < _HIGHEST_HANDLE_M
    )


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
