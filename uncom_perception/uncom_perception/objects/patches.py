# SPDX-License-Identifier: Apache-2.0
"""Small patches of a surface, even in place, slope and colour: what things are put together from (supervoxels)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_perception.types import Mask

Array = npt.NDArray[np.float64]
FloatImage = npt.NDArray[np.float32]
Index = npt.NDArray[np.int32]

_LEAST_SPACING = 6  # pixels between patches
_COLOUR = 14.0  # [Lab] as far as one spacing is in space
_SLOPE = 0.55  # between unit normals, likewise
_MOST = 220  # about so many patches of one surface; those of large ones are wider
_MIN_POINTS = 6


@dataclass(frozen=True, slots=True)
class Patches:
    """Patches of one surface: the image of their numbers (H, W), 0 beside it, and their measures by number.

    These are centres (N, 3) [m], unit normals (N, 3), colours (N, 3) [Lab], numbers of pixels (N,), unevenness (N,) [m]
    and half widths (N,) [m]; row 0 is void.
    """

    index: Index
    centre: Array
    normal: Array
    lab: Array
    size: Array
    uneven: Array
    reach: Array


def patches_of(points: FloatImage, normals: FloatImage, lab: FloatImage, own: Mask, pixel_m: float) -> Patches:
    """Cut a surface (a mask (H, W) of known points) into patches about _LEAST_SPACING pixels wide or more.

    Args:
        points: (H, W, 3) [m].
        normals: (H, W, 3), about unit vectors.
        lab: (H, W, 3).
        own: the surface.
        pixel_m: how wide a pixel is [m].
    """
    v, u = np.nonzero(own)
    weight = np.array([0.5, 1.0, 1.0], np.float32) / np.float32(_COLOUR)
    spacing = max(_LEAST_SPACING, round(math.sqrt(len(v) / _MOST)))
    place = points[v, u] / np.float32(spacing * pixel_m)
    features = np.concatenate([place, normals[v, u] / np.float32(_SLOPE), lab[v, u] * weight], axis=1)
    row, column = v // spacing, u // spacing
    table = np.full((int(row.max()) + 3, int(column.max()) + 3), -1, np.int32)
    cell = (row + 1) * table.shape[1] + column + 1
    used, chosen = np.unique(cell, return_inverse=True)
    table.ravel()[used] = np.arange(len(used))
    around = (0, -1, 1, -table.shape[1], table.shape[1])
    count = np.maximum(np.bincount(chosen, minlength=len(used)), 1)
    sums = [np.bincount(chosen, weights=features[:, k], minlength=len(used)) for k in range(9)]
    middle = (np.column_stack(sums) / count[:, None]).astype(np.float32)
    best = np.full(len(v), np.inf, np.float32)
    for step in around:
        candidate = table.ravel()[cell + step]
        rest = features - middle[candidate]
        distance = np.einsum("ij,ij->i", rest, rest)
        distance[candidate < 0] = np.inf
        closer = distance < best
        best[closer], chosen[closer] = distance[closer], candidate[closer]
    numbers = np.unique(chosen, return_inverse=True)[1].reshape(-1) + 1
    index = np.zeros(own.shape, np.int32)
    index[v, u] = numbers
    return _measured(index, numbers, points[v, u].astype(float), normals[v, u], lab[v, u], pixel_m)


def _measured(
    index: Index, numbers: npt.NDArray[np.int64], points: Array, normals: FloatImage, lab: FloatImage, pixel_m: float
) -> Patches:
    """Fit a plane to each patch."""
    count = int(numbers.max()) + 1
    size = np.maximum(np.bincount(numbers, minlength=count), 1).astype(float)

    def means(values: npt.NDArray[np.floating]) -> Array:
        columns = [np.bincount(numbers, weights=values[:, k], minlength=count) for k in range(values.shape[1])]
        return np.asarray(np.column_stack(columns) / size[:, None])

    centre = means(points)
    rest = points - centre[numbers]
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    products = means(np.column_stack([rest[:, i] * rest[:, j] for i, j in pairs]))
    spread = np.empty((count, 3, 3))
    for k, (i, j) in enumerate(pairs):
        spread[:, i, j] = spread[:, j, i] = products[:, k]
    values, vectors = np.linalg.eigh(spread)
    rough = means(normals)
    normal = vectors[:, :, 0]
    normal = normal * np.where(np.einsum("ij,ij->i", normal, rough) < 0.0, -1.0, 1.0)[:, None]
    # Too few points, or points in a row, tell no slope: that of the wider neighbourhood is taken.
    poor = (size < _MIN_POINTS) | (values[:, 1] < (0.4 * pixel_m) ** 2)
    normal[poor] = rough[poor] / np.maximum(np.linalg.norm(rough[poor], axis=1, keepdims=True), 1e-6)
    uneven = np.sqrt(np.maximum(values[:, 0], 0.0))
    reach = np.sqrt(3.0 * np.maximum(values[:, 1], (0.4 * pixel_m) ** 2))
    return Patches(index, centre, normal, means(lab), size, uneven, reach)
