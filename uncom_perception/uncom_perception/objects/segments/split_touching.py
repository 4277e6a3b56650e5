# SPDX-License-Identifier: Apache-2.0
"""Objects that touch: told apart where their surfaces meet in a fold.

Colour alone splits a box at its print, shape alone a pan at its handle; together they tell an apple from the box that
it leans on, and a lemon from the bowl that it lies in.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import medians, quantile
from uncom_perception.objects.segments.foreground import LabelImage, Surfaces
from uncom_perception.objects.segments.join_fragments import alike_colours
from uncom_perception.objects.segments.options import SPLIT, SplitOptions
from uncom_perception.objects.segments.patch_merging import borders, evidence, merged, with_bridges
from uncom_perception.objects.segments.regions import Regions, regions_of
from uncom_perception.objects.segments.surface_fitting import is_floor, is_handle, is_neck
from uncom_perception.objects.segments.surface_patches import Patches, find_patches
from uncom_perception.types import Mask


def split_touching(
    surfaces: Surfaces, regions: Regions, *, options: SplitOptions = SPLIT
) -> tuple[Regions, npt.NDArray[np.int32]]:
    """Return regions in which objects that meet in a fold have labels of their own, and what each was (L + 1,)."""
    unsure = np.zeros(regions.count + 1, bool)
    sizes = regions.sizes
    for label, box in regions.boxes().items():
        unsure[label] = sizes[label] >= options.least_pixels and not _plainly_one(
            surfaces, regions, label, box, options=options
        )
    parts = _parts(surfaces, regions, unsure, options=options) if unsure.any() else None
    if parts is None:
        return regions, np.arange(regions.count + 1, dtype=np.int32)
    pixels, part, surface = parts
    # The parts of a surface that falls apart are new labels.
    several = np.bincount(surface[1:], minlength=regions.count + 1) > 1
    numbers = np.where(several[surface], regions.count + np.cumsum(several[surface]), surface).astype(np.int32)
    labels = regions.labels.copy()
    labels.ravel()[pixels] = numbers[part]
    origin = np.arange(max(regions.count, int(numbers.max())) + 1, dtype=np.int32)
    origin[numbers] = surface
    return regions_of(labels), origin


def _plainly_one(
    surfaces: Surfaces, regions: Regions, label: int, box: tuple[slice, slice], *, options: SplitOptions = SPLIT
) -> bool:
    """Whether a surface has one colour and a convex outline in the image, as hardly any two objects together have."""
    some = surfaces.lab.reshape(-1, 3)[regions.of(label)[:: options.colour_stride]]
    even, shaded = np.ones((2, len(some)), bool)
    for k in (1, 2):
        relative = some[:, k] / (some[:, 0] + 12.0)  # in the shade chroma shrinks with lightness
        even &= np.abs(some[:, k] - quantile(some[:, k], 50)) < options.even_colour
        shaded &= np.abs(relative - quantile(relative, 50)) < options.even_shaded
    if np.count_nonzero(even | shaded) < options.even_share * len(even):
        return False
    own = (regions.labels[box] == label).view(np.uint8)
    contours = cv2.findContours(own, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
    hull = cv2.convexHull(np.concatenate(contours))
    return float(regions.sizes[label]) > options.solid * float(cv2.contourArea(hull))


def _parts(
    surfaces: Surfaces, regions: Regions, unsure: Mask, *, options: SplitOptions = SPLIT
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int32]] | None:
    """Put surfaces that may be several objects together from patches.

    Returns:
        The (flat) pixels of those surfaces, the part (N,) that each is of, and the surface that each part is of (P,);
        part 0 is void. None if there is nothing to look at.
    """
    coarse = surfaces.thinned(options.stride)
    points = coarse.ground_points
    labels = np.where(unsure, np.arange(len(unsure), dtype=np.int32), 0)[
        regions.labels[:: options.stride, :: options.stride]
    ]
    labels[~np.isfinite(points[..., 2])] = 0
    enough = np.bincount(labels.ravel(), minlength=len(unsure)) >= options.least_pixels // options.stride**2
    enough[0] = False
    if not enough.any():
        return None
    labels[~enough[labels]] = 0
    patches = find_patches(points, _normals(points, np.flatnonzero(labels)), coarse.lab, labels, coarse.pixel_m)
    pixels = np.concatenate([regions.of(label) for label in np.flatnonzero(enough).tolist()])
    index = _grown(patches, regions, pixels, options=options)
    a, b, length = borders(patches.index, coarse.across, coarse.down)
    a, b, length = with_bridges((a, b, length), borders(index, surfaces.across, surfaces.down))
    group = np.arange(len(patches.size))
    if len(a):
        score, colour = evidence(patches, a, b)
        group = merged(patches, a, b, length, score, colour)
        least = (
            np.maximum(options.least_part_pixels, options.least_part_share * regions.sizes[patches.surface])
            / options.stride**2
        )
        group = _without_scraps(group, patches.size, (a, b, length), least)
        group = _with_fittings(group, patches, points, (a, b), options=options)
    kept, numbers = np.unique(group[1:], return_inverse=True)
    surface = np.concatenate([[0], patches.surface[kept]]).astype(np.int32)
    return pixels, np.concatenate([[0], numbers.reshape(-1) + 1])[index.ravel()[pixels]], surface


def _without_scraps(
    group: npt.NDArray[np.int64],
    size: npt.NDArray[np.float64],
    pairs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64]],
    least: npt.NDArray[np.float64],
) -> npt.NDArray[np.int64]:
    """Give groups of few pixels to the neighbour with which they share most of their border, the smallest first.

    What few pixels are is told by patch.
    """
    group = group.copy()
    a, b, length = pairs
    while True:
        pixels = np.bincount(group[1:], weights=size[1:], minlength=len(group))
        i, j = group[a], group[b]
        outer = i != j
        touching = np.unique(np.concatenate([i[outer], j[outer]]))
        small = touching[pixels[touching] < least[touching]]
        if len(small) == 0:
            return group
        scrap = int(small[pixels[small].argmin()])
        shared = np.bincount(j[outer & (i == scrap)], weights=length[outer & (i == scrap)], minlength=len(group))
        shared = shared + np.bincount(
            i[outer & (j == scrap)], weights=length[outer & (j == scrap)], minlength=len(group)
        )
        group[group == scrap] = int(shared.argmax())


def _with_fittings(
    group: npt.NDArray[np.int64],
    patches: Patches,
    points: npt.NDArray[np.float32],
    pairs: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
    *,
    options: SplitOptions = SPLIT,
) -> npt.NDArray[np.int64]:
    """Join groups that are caps, handles or floors of others with them."""
    group = group.copy()
    a, b = pairs
    i, j = group[a], group[b]
    if (i == j).all():
        return group
    used = np.flatnonzero(patches.index)
    flat, index = points.reshape(-1, 3)[used], patches.index.ravel()[used]
    seen: dict[int, tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]] = {}
    apart: set[tuple[int, int]] = set()

    def looks(k: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]:
        if k not in seen:
            seen[k] = flat[group[index] == k], medians(patches.lab[group == k])
        return seen[k]

    while True:
        i, j = group[a], group[b]
        outer = i != j
        touching = {(min(p), max(p)) for p in zip(i[outer].tolist(), j[outer].tolist(), strict=True)}
        fitting = None
        for pair in sorted(touching - apart):
            (one, colour), (other, other_colour) = (looks(k) for k in pair)
            if _fit(one, other, colour, other_colour, options=options):
                fitting = pair
                break
            apart.add(pair)
        if fitting is None:
            return group
        group[group == fitting[1]] = fitting[0]
        for k in fitting:
            seen.pop(k, None)
        apart = {pair for pair in apart if not set(pair) & set(fitting)}


def _fit(
    one: npt.NDArray[np.float32],
    other: npt.NDArray[np.float32],
    colour: npt.NDArray[np.float64],
    other_colour: npt.NDArray[np.float64],
    *,
    options: SplitOptions = SPLIT,
) -> bool:
    alike = alike_colours(colour, other_colour)
    return _is_fitting(one, other, alike=alike, options=options) or _is_fitting(
        other, one, alike=alike, options=options
    )


def _grown(
    patches: Patches, regions: Regions, pixels: npt.NDArray[np.int64], *, options: SplitOptions = SPLIT
) -> LabelImage:
    """Give each of the (flat) pixels the number of a patch next to it, of its own surface, in the thinned image."""
    height, width = regions.labels.shape
    near = np.repeat(np.repeat(patches.index, options.stride, 0), options.stride, 1)[:height, :width]
    # With a border, so that all pixels have neighbours.
    full = np.zeros((height + 2, width + 2), np.int32)
    full[1:-1, 1:-1] = near
    places = (pixels // width + 1) * (width + 2) + pixels % width + 1
    own = regions.labels.ravel()[pixels]
    numbers = full.ravel()[places]
    wrong = np.flatnonzero(patches.surface[numbers] != own)
    numbers[wrong] = 0
    full.fill(0)
    full.ravel()[places] = numbers
    for _ in range(options.rounds):
        if len(wrong) == 0:
            break
        for step in (-1, 1, -width - 2, width + 2, -width - 3, -width - 1, width + 1, width + 3):
            candidate = full.ravel()[places[wrong] + step]
            fits = (numbers[wrong] == 0) & (patches.surface[candidate] == own[wrong])
            numbers[wrong[fits]] = candidate[fits]
        full.ravel()[places[wrong]] = numbers[wrong]
        wrong = wrong[numbers[wrong] == 0]
    if len(wrong):  # out of the way of any: any patch of its surface will do
        first = np.zeros(int(patches.surface.max()) + 1, np.int32)
        first[patches.surface] = np.arange(len(patches.surface))
        full.ravel()[places[wrong]] = first[own[wrong]]
    return np.ascontiguousarray(full[1:-1, 1:-1])


def _normals(points: npt.NDArray[np.float32], where: npt.NDArray[np.int64]) -> npt.NDArray[np.float32]:
    """Return an image of unit normals (H, W, 3) towards above or the camera, over windows of 9 pixels.

    Only at the (flat) pixels that are asked for; elsewhere it is 0.
    """
    height, width = points.shape[:2]
    known = np.isfinite(points[..., 2])
    filled = points.copy()
    filled[~known] = 0.0
    counts = cv2.boxFilter(known.view(np.uint8), -1, (5, 5), normalize=False)
    smooth = cv2.copyMakeBorder(cv2.boxFilter(filled, -1, (5, 5), normalize=False), 2, 2, 2, 2, cv2.BORDER_REPLICATE)
    counts = cv2.copyMakeBorder(counts, 2, 2, 2, 2, cv2.BORDER_REPLICATE)
    wide = width + 4
    places = (where // width + 2) * wide + where % width + 2
    sums, flat = smooth.reshape(-1, 3), np.maximum(counts.ravel(), 1).astype(np.float32)[:, None]
    right, left, lower, upper = (sums[places + step] / flat[places + step] for step in (2, -2, 2 * wide, -2 * wide))
    normal = _cross(lower - upper, right - left)
    normal /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normal, normal)), np.float32(1e-12))[:, None]
    result = np.zeros((height * width, 3), np.float32)
    result[where] = normal
    return result.reshape(points.shape)


def _cross(a: npt.NDArray[np.float32], b: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the cross products (N, 3) of vectors (N, 3); for many short ones quicker than np.cross."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _is_fitting(
    mine: npt.NDArray[np.float32], theirs: npt.NDArray[np.float32], *, alike: bool, options: SplitOptions = SPLIT
) -> bool:
    """Whether a patch is a small top of another (cap, lid, stem), its neck, or a thin part that it holds (handle)."""
    length = max(cv2.minAreaRect(cv2.convexHull(np.ascontiguousarray(mine[:, :2])))[1])
    low = quantile(mine[:, 2], 5)
    if low > quantile(theirs[:, 2], 80) and length < options.small_top_m:
        return True
    if alike and is_neck(mine, theirs):
        return True
    return is_handle(mine, theirs, alike=alike) or is_floor(mine, theirs, alike=alike)
