# SPDX-License-Identifier: Apache-2.0
"""Small patches of a surface, even in place, slope and colour: what objects are put together from (supervoxels)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.segments.options import SURFACE_PATCHES, SurfacePatchOptions

Array = npt.NDArray[np.float64]
FloatImage = npt.NDArray[np.float32]
Index = npt.NDArray[np.int32]
Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Patches:
    """Patches of surfaces: the image of their numbers (H, W), 0 beside them, and their measures by number.

    These are centres (N, 3) [m], unit normals (N, 3), colours (N, 3) [Lab], numbers of pixels (N,), unevenness (N,) [m]
    and half widths (N,) [m], the surface that each is of (N,) and how uneven that is on the whole (N,) [m]; row 0 is
    void.
    """

    index: Index
    centre: Array
    normal: Array
    lab: Array
    size: Array
    uneven: Array
    reach: Array
    surface: Index
    noise: Array


def find_patches(
    points: FloatImage,
    normals: FloatImage,
    lab: FloatImage,
    surfaces: Index,
    pixel_m: float,
    *,
    options: SurfacePatchOptions = SURFACE_PATCHES,
) -> Patches:
    """Cut surfaces into patches about _LEAST_SPACING pixels wide or more.

    Args:
        options: numbers that tune it.
        points: (H, W, 3) [m].
        normals: (H, W, 3), about unit vectors.
        lab: (H, W, 3).
        surfaces: the number of each pixel's surface (H, W), 0 for none; their points are known.
        pixel_m: how wide a pixel is [m].
    """
    used = np.flatnonzero(surfaces)
    v, u = np.divmod(used, surfaces.shape[1])
    ids = surfaces.ravel()[used]
    spacings = np.maximum(options.least_spacing_px, np.round(np.sqrt(np.bincount(ids) / options.most))).astype(np.int64)
    spacing = spacings[ids]
    place, slope, colour = (image.reshape(-1, 3)[used] for image in (points, normals, lab))
    weight = np.array([0.5, 1.0, 1.0], np.float32) / np.float32(options.colour)
    scale = (1.0 / (spacing * pixel_m)).astype(np.float32)[:, None]
    features = np.concatenate([place * scale, slope * np.float32(1.0 / options.slope), colour * weight], axis=1)
    row, column = ((k - _least(k, ids)[ids]) // spacing for k in (v, u))
    chosen = _nearest_seeds(features, *_cells(row, column, ids))
    counts = np.bincount(chosen)
    numbers = np.asarray(np.cumsum(counts > 0), np.int64)[chosen]
    index = np.zeros(surfaces.shape, np.int32)
    index.ravel()[used] = numbers
    return _measured(index, numbers, ids, (place.astype(float), slope, colour), pixel_m, options=options)


def _cells(row: Numbers, column: Numbers, ids: Index) -> tuple[Numbers, Numbers, int]:
    """Return the cell (N,) of each pixel in a grid of its surface's own, how long the rows (N,) of that are, and all.

    Grids are laid out one after another, each with a free border.
    """
    height, width = (3 - _least(-k, ids) for k in (row, column))
    ends = np.cumsum(height * width)
    length = width[ids]
    return (ends - height * width)[ids] + (row + 1) * length + column + 1, length, int(ends[-1])


def _least(values: Numbers, ids: Index) -> Numbers:
    """Return the least value by id (K,), 0 for those that there are none of."""
    least = np.full(int(ids.max()) + 1, np.iinfo(np.int64).max)
    np.minimum.at(least, ids, values)
    return np.where(least == np.iinfo(np.int64).max, 0, least)


def _nearest_seeds(features: FloatImage, cell: Numbers, length: Numbers, total: int) -> Numbers:
    """Return for each pixel which of the five cells about it has the mean features most like its own."""
    count = np.bincount(cell, minlength=total)
    filled = count > 0
    table = np.where(filled, np.cumsum(filled) - 1, -1)
    chosen = table[cell]
    most = int(filled.sum())
    sums = [np.bincount(chosen, weights=features[:, k], minlength=most) for k in range(features.shape[1])]
    middle = (np.stack(sums, axis=1) / count[filled][:, None]).astype(np.float32)
    best = np.full(len(cell), np.inf, np.float32)
    for step in (0, -1, 1, -length, length):
        candidate = table[cell + step]
        rest = features - middle[candidate]
        distance = np.einsum("ij,ij->i", rest, rest)
        distance[candidate < 0] = np.inf
        closer = distance < best
        best = np.where(closer, distance, best)
        chosen = np.where(closer, candidate, chosen)
    return chosen


def _measured(
    index: Index,
    numbers: Numbers,
    ids: Index,
    values: tuple[Array, FloatImage, FloatImage],
    pixel_m: float,
    *,
    options: SurfacePatchOptions = SURFACE_PATCHES,
) -> Patches:
    """Fit a plane to each patch; values are the pixels' points, normals and colours (N, 3)."""
    points, normals, lab = values
    count = int(numbers.max()) + 1
    size = np.maximum(np.bincount(numbers, minlength=count), 1).astype(float)

    def means(columns: Iterable[npt.NDArray[np.floating]]) -> Array:
        sums = [np.bincount(numbers, weights=column, minlength=count) for column in columns]
        return np.asarray(np.stack(sums, axis=1) / size[:, None])

    centre = means(points.T)
    rest = (points - centre[numbers]).T
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    products = means([rest[i] * rest[j] for i, j in pairs])
    spread = np.empty((count, 3, 3))
    for k, (i, j) in enumerate(pairs):
        spread[:, i, j] = spread[:, j, i] = products[:, k]
    widths, vectors = np.linalg.eigh(spread)
    rough = means(normals.T)
    normal = vectors[:, :, 0]
    normal = normal * np.where(np.einsum("ij,ij->i", normal, rough) < 0.0, -1.0, 1.0)[:, None]
    # Too few points, or points in a row, tell no slope: that of the wider neighbourhood is taken.
    poor = (size < options.least_points) | (widths[:, 1] < (0.4 * pixel_m) ** 2)
    normal[poor] = rough[poor] / np.maximum(np.linalg.norm(rough[poor], axis=1, keepdims=True), 1e-6)
    uneven = np.sqrt(np.maximum(widths[:, 0], 0.0))
    reach = np.sqrt(3.0 * np.maximum(widths[:, 1], (0.4 * pixel_m) ** 2))
    surface = np.zeros(count, np.int32)
    surface[numbers] = ids
    noise = np.zeros(count)
    for number in np.flatnonzero(np.bincount(surface)).tolist():
        own = surface == number
        noise[own] = quantile(uneven[own], 50)
    return Patches(index, centre, normal, means(lab.T), size, uneven, reach, surface, noise)
