# SPDX-License-Identifier: Apache-2.0
"""Patches of a surface put together to objects: the best fitting ones first, until only folds are left.

After the locally convex patches of Stein et al. (2014). What two groups of patches have in common is judged along
their whole border, so that a border that noise blurs in one place does not join what the rest of it parts.
"""

from __future__ import annotations

import heapq
import math

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.segments.foreground import LabelImage
from uncom_perception.objects.segments.options import PATCH_MERGE, PatchMergeOptions
from uncom_perception.objects.segments.surface_patches import Patches
from uncom_perception.types import Mask

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

_NO_LINK = (0.0, 0.0, 0.0)


def borders(index: LabelImage, across: Mask, down: Mask) -> tuple[Numbers, Numbers, Array]:
    """Return pairs of patches (E,), (E,) that touch, and the length of their borders (E,) in pixels.

    The index (H, W) holds the number of the patch of every pixel, 0 for none; across (H, W - 1) and down (H - 1, W)
    tell which neighbouring pixels touch in space.
    """
    count = int(index.max()) + 1
    keys = []
    for here, ahead, touch in ((index[:, :-1], index[:, 1:], across), (index[:-1], index[1:], down)):
        edge = touch & (here != ahead) & (here > 0) & (ahead > 0)
        a, b = here[edge].astype(np.int64), ahead[edge].astype(np.int64)
        keys.append(np.minimum(a, b) * count + np.maximum(a, b))
    pairs, length = np.unique(np.concatenate(keys), return_counts=True)
    return pairs // count, pairs % count, length.astype(float)


def with_bridges(
    wide: tuple[Numbers, Numbers, Array],
    narrow: tuple[Numbers, Numbers, Array],
    *,
    options: PatchMergeOptions = PATCH_MERGE,
) -> tuple[Numbers, Numbers, Array]:
    """Add to pairs of patches, and the length of their borders, those that only narrow bridges join, which say less."""
    count = 1 + max(int(side.max(initial=0)) for side in (wide[1], narrow[1]))
    new = ~np.isin(narrow[0] * count + narrow[1], wide[0] * count + wide[1])
    a, b = (np.concatenate([wide[k], narrow[k][new]]) for k in (0, 1))
    return a, b, np.concatenate([wide[2], options.bridge_weight * narrow[2][new]])


def evidence(
    patches: Patches, a: Numbers, b: Numbers, *, options: PatchMergeOptions = PATCH_MERGE
) -> tuple[Array, Array]:
    """Return for pairs of patches how much speaks for one object (> 0) or two, and how unlike their colours are."""
    apart = patches.centre[a] - patches.centre[b]
    distance = np.maximum(np.sqrt(np.einsum("ij,ij->i", apart, apart)), 1e-6)
    fold = np.einsum("ij,ij->i", patches.normal[a] - patches.normal[b], apart) / distance
    unlike = (patches.lab[a] - patches.lab[b]) * np.array([0.5, 1.0, 1.0])
    colour = np.sqrt(np.einsum("ij,ij->i", unlike, unlike))
    unlike = np.clip((colour - options.alike) / (options.unlike - options.alike), 0.0, 1.0)
    noise = patches.noise[a] / np.maximum(np.minimum(patches.reach[a], patches.reach[b]), 1e-3)
    limit = (
        options.sharp_fold
        + (options.fold - options.sharp_fold) * unlike
        + options.noise_factor * noise / np.sqrt(np.minimum(patches.size[a], patches.size[b]))
    )
    return np.clip((fold + limit) / options.fold_softness, options.most_against, 1.0), colour


def merged(
    patches: Patches,
    a: Numbers,
    b: Numbers,
    length: Array,
    score: Array,
    colour: Array,
    *,
    options: PatchMergeOptions = PATCH_MERGE,
) -> Numbers:
    """Return the group of each patch (N,): pairs whose common border speaks for one object joined."""
    parent = np.arange(len(patches.size))
    width = np.sqrt(patches.size)
    for_one, unlike = length * score, length * colour
    links: list[dict[int, tuple[float, float, float]]] = [{} for _ in parent]
    for i, j, *link in zip(*(v.tolist() for v in (a, b, length, for_one, unlike)), strict=True):
        links[i][j] = links[j][i] = (link[0], link[1], link[2])
    # Large objects that only a narrow neck joins touch by chance, the more so if they differ in colour there.
    wide = for_one > np.where(unlike > options.alike * length, options.neck, options.neck_alike) * np.minimum(
        width[a], width[b]
    )
    rank = options.colour_weight * np.minimum(colour, options.most_unlike) * length - for_one
    heap = list(zip(*(v[wide].tolist() for v in (rank, a, b, length)), strict=True))
    heapq.heapify(heap)
    widths = width.tolist()
    while heap:
        _, i, j, total = heapq.heappop(heap)
        current = links[i].get(j)
        if current is None or current[0] != total:
            continue
        if current[1] <= (options.neck if current[2] > options.alike * total else options.neck_alike) * min(
            widths[i], widths[j]
        ):
            continue
        if len(links[i]) < len(links[j]):
            i, j = j, i
        parent[j] = i
        widths[i] = math.sqrt(widths[i] ** 2 + widths[j] ** 2)
        _hand_over(links, i, j, widths, heap, options=options)
    while (parent[parent] != parent).any():
        parent = parent[parent]
    return parent


def _hand_over(
    links: list[dict[int, tuple[float, float, float]]],
    i: int,
    j: int,
    widths: list[float],
    heap: list[tuple[float, int, int, float]],
    *,
    options: PatchMergeOptions = PATCH_MERGE,
) -> None:
    """Give group i the links of group j, which is part of it now."""
    mine = links[i]
    del mine[j]
    for k, added in links[j].items():
        if k == i:
            continue
        other = links[k]
        del other[j]
        old = mine.get(k, _NO_LINK)
        total, for_one, unlike = added[0] + old[0], added[1] + old[1], added[2] + old[2]
        mine[k] = other[i] = (total, for_one, unlike)
        # What did not change only grew narrower, beside larger objects.
        if for_one > (options.neck if unlike > options.alike * total else options.neck_alike) * min(
            widths[i], widths[k]
        ):
            rank = options.colour_weight * min(unlike, options.most_unlike * total) - for_one
            heapq.heappush(heap, (rank, i, k, total) if i < k else (rank, k, i, total))
    links[j] = {}
