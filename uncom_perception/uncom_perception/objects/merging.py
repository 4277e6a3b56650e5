# SPDX-License-Identifier: Apache-2.0
"""Patches of a surface put together to things: the best fitting ones first, until only folds are left.

After the locally convex patches of Stein et al. (2014). What two groups of patches have in common is judged along
their whole border, so that a border that noise blurs in one place does not join what the rest of it parts.
"""

from __future__ import annotations

import heapq
import math

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.patches import Patches
from uncom_perception.objects.segments import LabelImage
from uncom_perception.types import Mask

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]

_FOLD = 0.22  # how concave a border must be to part things [sine, about], where their colours differ
_SHARP_FOLD = 0.5  # and where they do not
_ALIKE, _UNLIKE = 5.0, 13.0  # [Lab, lightness at half weight]
_SOFT = 0.3  # of folds: what lies so far beyond the limit counts fully
_MOST_AGAINST = -1.5
_COLOUR_WEIGHT = 0.02  # of the order in which groups are joined
_TIMES_NOISE = 1.5
_NECK, _NECK_ALIKE = 0.3, 0.12  # of a thing's width: what joins it to another must be wider than this
_BRIDGE = 0.15  # weight of a pixel's border in a narrow bridge


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
    wide: tuple[Numbers, Numbers, Array], narrow: tuple[Numbers, Numbers, Array]
) -> tuple[Numbers, Numbers, Array]:
    """Add to pairs of patches, and the length of their borders, those that only narrow bridges join, which say less."""
    known = set(zip(wide[0].tolist(), wide[1].tolist(), strict=True))
    new = np.array([pair not in known for pair in zip(narrow[0].tolist(), narrow[1].tolist(), strict=True)], dtype=bool)
    a, b = (np.concatenate([wide[k], narrow[k][new]]) for k in (0, 1))
    return a, b, np.concatenate([wide[2], _BRIDGE * narrow[2][new]])


def evidence(patches: Patches, a: Numbers, b: Numbers) -> tuple[Array, Array]:
    """Return for pairs of patches how much speaks for one thing (> 0) or two, and how unlike their colours are."""
    apart = patches.centre[a] - patches.centre[b]
    distance = np.maximum(np.linalg.norm(apart, axis=1), 1e-6)
    fold = np.einsum("ij,ij->i", patches.normal[a] - patches.normal[b], apart) / distance
    colour = np.linalg.norm((patches.lab[a] - patches.lab[b]) * np.array([0.5, 1.0, 1.0]), axis=1)
    unlike = np.clip((colour - _ALIKE) / (_UNLIKE - _ALIKE), 0.0, 1.0)
    noise = float(np.median(patches.uneven[1:])) / np.maximum(np.minimum(patches.reach[a], patches.reach[b]), 1e-3)
    limit = (
        _SHARP_FOLD
        + (_FOLD - _SHARP_FOLD) * unlike
        + _TIMES_NOISE * noise / np.sqrt(np.minimum(patches.size[a], patches.size[b]))
    )
    return np.clip((fold + limit) / _SOFT, _MOST_AGAINST, 1.0), colour


def merged(patches: Patches, a: Numbers, b: Numbers, length: Array, score: Array, colour: Array) -> Numbers:
    """Return the group of each patch (N,): pairs whose common border speaks for one thing joined."""
    count = len(patches.size)
    parent = np.arange(count)
    size = patches.size.tolist()
    links: list[dict[int, tuple[float, float, float]]] = [{} for _ in range(count)]
    heap: list[tuple[float, int, int, float]] = []

    def wide(i: int, j: int) -> bool:
        # Large things that only a narrow neck joins touch by chance, the more so if they differ in colour there.
        total, for_one, unlike = links[i][j]
        neck = _NECK if unlike > _ALIKE * total else _NECK_ALIKE
        return for_one > neck * math.sqrt(min(size[i], size[j]))

    def push(i: int, j: int) -> None:
        if wide(i, j):
            total, for_one, unlike = links[i][j]
            rank = for_one - _COLOUR_WEIGHT * min(unlike / total, 25.0) * total
            heapq.heappush(heap, (-rank, min(i, j), max(i, j), total))

    for i, j, n, s, c in zip(a.tolist(), b.tolist(), length.tolist(), score.tolist(), colour.tolist(), strict=True):
        links[i][j] = links[j][i] = (n, n * s, n * c)
        push(i, j)
    while heap:
        _, i, j, total = heapq.heappop(heap)
        if parent[i] != i or parent[j] != j or j not in links[i] or links[i][j][0] != total:
            continue
        if not wide(i, j):
            continue
        if len(links[i]) < len(links[j]):
            i, j = j, i
        parent[j] = i
        size[i] += size[j]
        del links[i][j]
        for k, link in links[j].items():
            if k == i:
                continue
            del links[k][j]
            old = links[i].get(k, (0.0, 0.0, 0.0))
            links[i][k] = links[k][i] = (old[0] + link[0], old[1] + link[1], old[2] + link[2])
            push(i, k)  # what did not change only grew narrower, beside larger things
        links[j] = {}
    while (parent[parent] != parent).any():
        parent = parent[parent]
    return parent
