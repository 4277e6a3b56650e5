# SPDX-License-Identifier: Apache-2.0
"""Joining the surfaces of one object that holes in the depth, or its own shape, part in the image."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import medians
from uncom_perception.objects.segments.foreground import Surfaces
from uncom_perception.objects.segments.inside_test import is_inside
from uncom_perception.objects.segments.options import FRAGMENT_JOIN, SURFACE_FIT, FragmentJoinOptions, SurfaceFitOptions
from uncom_perception.objects.segments.regions import Pixels, Regions
from uncom_perception.objects.segments.surface_fitting import (
    has_top,
    held_by,
    is_handle,
    may_be_hollow,
    one_body,
    outline,
)
from uncom_perception.types import Mask


class _Groups:
    """Labels that are joined step by step, but never two that were parted, nor what each of them is joined with."""

    def __init__(self, parted: Mask) -> None:
        """Begin with one group a label; parted (L + 1, L + 1) tells which labels are two objects."""
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

    def renumbered(self, regions: Regions) -> tuple[Regions, Mask]:
        """Return the groups as regions, and which of those are parted."""
        roots = np.array([self.root(i) for i in range(len(self._parent))])
        if (roots == np.arange(len(roots))).all():
            return regions, self.parted
        kept, numbers = np.unique(roots, return_inverse=True)
        return regions.renumbered(numbers.reshape(-1)), self.parted[np.ix_(kept, kept)]


def parted_labels(
    surfaces: Surfaces,
    regions: Regions,
    origin: npt.NDArray[np.int32],
    viewer: npt.NDArray[np.float64],
    *,
    options: SurfaceFitOptions = SURFACE_FIT,
) -> Mask:
    """Return which labels (L + 1, L + 1) were parted at a fold: those of one origin (L + 1,) that are large enough.

    Inside and outside of a hollow object are parted only until they are seen to be of one colour, and one of them to
    have no top of its own, or until one is plainly the inside of the other as a viewer (3,) sees it.
    """
    large = regions.sizes >= options.fragment_pixels
    parted = (origin[:, None] == origin[None]) & large[:, None] & large[None]
    np.fill_diagonal(parted, False)
    parted[0] = parted[:, 0] = False
    if not parted.any():
        return np.asarray(parted)
    colours = _label_colours(surfaces, regions)
    points = surfaces.ground_points.reshape(-1, 3)
    clouds: dict[int, npt.NDArray[np.float32]] = {}
    insides: list[tuple[int, int]] = []
    for i, j in np.argwhere(np.triu(parted)).tolist():
        one, other = (clouds.setdefault(k, points[regions.of(k)]) for k in (i, j))
        insides += [(i, j)] * is_inside(one, other, viewer) + [(j, i)] * is_inside(other, one, viewer)
        if alike_colours(colours[i - 1], colours[j - 1]):
            parted[i, j] = parted[j, i] = not may_be_hollow(one, other)
    for inside, outside in insides:
        parted[inside, outside] = parted[outside, inside] = False
        same = ~parted[outside]  # its handle, say, which is parted from the inside only by the rim
        parted[inside, same] = parted[same, inside] = False
    return np.asarray(parted)


def join_fragments(
    surfaces: Surfaces,
    regions: Regions,
    parted: Mask,
    *,
    surface_fit_options: SurfaceFitOptions = SURFACE_FIT,
    fragment_join_options: FragmentJoinOptions = FRAGMENT_JOIN,
) -> tuple[Regions, Mask]:
    """Join surfaces of one object that holes or its own shape part in the image: they meet seen from above.

    Front and inner back wall of a cup, say. Only surfaces of alike colour, or small fragments, are joined; not those
    that are parted (L + 1, L + 1).
    """
    count = regions.count
    if count <= 1:
        return regions, parted
    cells, ids, level, width = _near_others(
        surfaces.ground_points.reshape(-1, 3)[regions.pixels], regions.ids(), options=fragment_join_options
    )
    contacts = _contacts(cells, ids, level, width, count, options=fragment_join_options)
    if not contacts.any():
        return regions, parted
    colours = _label_colours(surfaces, regions)
    groups = _Groups(parted)
    order = np.argwhere(np.triu(contacts) >= fragment_join_options.least_contacts)
    small = regions.sizes < surface_fit_options.fragment_pixels
    small[0] = True
    for i, j in sorted(order.tolist(), key=lambda pair: -int(contacts[pair[0], pair[1]])):
        if not (small[i] or small[j]) and alike_colours(colours[i - 1], colours[j - 1]):
            groups.join(i, j)
    # A fragment belongs to one object; it is no bridge between two.
    for i in (np.flatnonzero(small[1:]) + 1).tolist():
        nearest = int(contacts[i].argmax())
        if contacts[i, nearest] > 1:
            groups.join(i, nearest)
    return groups.renumbered(regions)


def _near_others(
    points: npt.NDArray[np.float32], ids: npt.NDArray[np.int32], *, options: FragmentJoinOptions = FRAGMENT_JOIN
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64], int]:
    """Return the cells, seen from above, that points (N, 3) of one label fill beside those of another.

    These are the cells' numbers (M,), sorted, their labels and mean heights, and how much the numbers grow by row.
    """
    x, y = (
        ((points[:, k] - points[:, k].min()) * np.float32(1.0 / options.cell_m)).astype(np.int32) + 1 for k in (0, 1)
    )
    width, height = int(x.max()) + 2, int(y.max()) + 2
    key = y * width + x
    last = np.zeros((height, width), np.uint16)
    last.ravel()[key] = ids
    kernel = np.ones((3, 3), np.uint8)
    other = cv2.dilate(last, kernel) != cv2.erode(np.where(last > 0, last, np.uint16(65535)), kernel)
    shared = np.zeros((height, width), np.uint8)
    shared.ravel()[key[last.ravel()[key] != ids]] = 1  # more than one label in a cell
    chosen = (other | cv2.dilate(shared, kernel).view(bool)).ravel()[key]
    count = int(ids[-1]) + 1
    pairs, place = np.unique(key[chosen].astype(np.int64) * count + ids[chosen], return_inverse=True)
    level = np.bincount(place, weights=points[chosen, 2]) / np.maximum(np.bincount(place), 1)
    return pairs // count, pairs % count, level, width


def _contacts(
    cells: npt.NDArray[np.int64],
    ids: npt.NDArray[np.int64],
    level: npt.NDArray[np.float64],
    width: int,
    count: int,
    *,
    options: FragmentJoinOptions = FRAGMENT_JOIN,
) -> npt.NDArray[np.int32]:
    """Count the neighbouring cells (sorted), seen from above, in which two labels lie at about the same height."""
    contacts = np.zeros((count + 1, count + 1), np.int32)
    for step in (0, 1, width, width + 1, width - 1):
        first, last = (np.searchsorted(cells, cells + step, side=side) for side in ("left", "right"))
        mine = np.repeat(np.arange(len(cells)), last - first)
        within = np.arange(len(mine)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
        other = first[mine] + within
        level_with = (ids[mine] != ids[other]) & (np.abs(level[mine] - level[other]) < options.same_level_m)
        a, b = ids[mine[level_with]], ids[other[level_with]]
        np.add.at(contacts, (a, b), 1)
        np.add.at(contacts, (b, a), 1)
    return contacts


def alike_colours(a: npt.NDArray[np.floating], b: npt.NDArray[np.floating]) -> bool:
    """Whether two Lab colours may be one surface in light and in shade, where chroma shrinks with lightness."""
    if abs(float(a[0] - b[0])) > FRAGMENT_JOIN.lightness_apart:
        return False
    plain = float(np.hypot(*(a[1:] - b[1:])))
    relative = float(np.hypot(*(a[1:] / (a[0] + 12.0) - b[1:] / (b[0] + 12.0))))
    return plain < FRAGMENT_JOIN.colour_apart or relative < FRAGMENT_JOIN.relative_colour_apart


def join_hollow(
    surfaces: Surfaces,
    regions: Regions,
    parted: Mask,
    viewer: npt.NDArray[np.float64],
    *,
    options: FragmentJoinOptions = FRAGMENT_JOIN,
) -> Regions:
    """Join the front of a hollow object and what is seen of its inside over the rim, where the rim itself was lost.

    Such surfaces border one another in the image, are alike in colour, and together are hardly longer than alone, or
    one is plainly the inside of the other as a viewer (3,) sees it; they are not parted (L + 1, L + 1).
    """
    corners: dict[int, npt.NDArray[np.float32]] = {}
    fitting: list[tuple[float, int, int]] = []
    points, lab = surfaces.ground_points.reshape(-1, 3), surfaces.lab.reshape(-1, 3)
    for i, j, facing, faced in _neighbours(regions, parted, options=options):
        gap = np.linalg.norm(points[facing].mean(axis=0) - points[faced].mean(axis=0))
        clouds = [points[regions.of(k)] for k in (i, j)]
        if gap < options.handle_gap_m and (is_handle(*clouds) or is_handle(*clouds[::-1])):
            fitting.append((-1.0, i, j))
            continue
        mine, theirs = medians(lab[facing]), medians(lab[faced])
        one = is_inside(clouds[0], clouds[1], viewer) or is_inside(clouds[1], clouds[0], viewer)
        if not one and alike_colours(mine, theirs) and not (has_top(clouds[0]) and has_top(clouds[1])):
            hulls = [corners.setdefault(k, outline(cloud)) for k, cloud in zip((i, j), clouds, strict=True)]
            one = one_body(*hulls) or held_by(*clouds) or held_by(*clouds[::-1])
        if one:
            fitting.append((float(np.linalg.norm(mine - theirs)), i, j))
    groups = _Groups(parted)
    for _, i, j in sorted(fitting):
        groups.join(i, j)
    return groups.renumbered(regions)[0]


def _neighbours(
    regions: Regions, parted: Mask, *, options: FragmentJoinOptions = FRAGMENT_JOIN
) -> Iterator[tuple[int, int, Pixels, Pixels]]:
    """Give pairs of labels that border one another in the image, and the (flat) pixels of each at the border."""
    kernel = np.ones((9, 9), np.uint8)
    width = regions.labels.shape[1]
    for i, box in regions.boxes().items():
        rows, columns = (slice(max(0, s.start - 5), s.stop + 5) for s in box)
        part = regions.labels[rows, columns]
        lower = part[(part > 0) & (part < i)]
        if len(lower) < options.border_pixels:
            continue
        own = part == i
        near = cv2.dilate(own.view(np.uint8), kernel).view(bool)
        counts = np.bincount(part[near], minlength=i)[:i]
        counts[0] = 0
        for j in np.flatnonzero(counts >= options.border_pixels).tolist():
            if parted[i, j]:
                continue
            other = part == j
            facing = own & cv2.dilate(other.view(np.uint8), kernel).view(bool)
            both = (np.nonzero(mask) for mask in (facing, near & other))
            mine, theirs = ((v + rows.start) * width + u + columns.start for v, u in both)
            yield i, j, mine, theirs


def _label_colours(surfaces: Surfaces, regions: Regions) -> npt.NDArray[np.float32]:
    """Return the median Lab colour of each label from 1 on."""
    colours = np.zeros((regions.count, 3), np.float32)
    lab = surfaces.lab.reshape(-1, 3)
    for label in np.flatnonzero(regions.sizes).tolist():
        own = regions.of(label)
        colours[label - 1] = medians(lab[own[:: max(1, len(own) // 400)]])
    return colours
