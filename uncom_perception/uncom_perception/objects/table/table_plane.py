# SPDX-License-Identifier: Apache-2.0
"""The plane of the table top, by RANSAC (scikit-image)."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from skimage.measure import ransac

from uncom_perception.exceptions import TableNotFoundError
from uncom_perception.image_arrays import quantile
from uncom_perception.objects.table.options import TABLE_PLANE, TablePlaneOptions

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Plane:
    """Points p with normal @ p == offset; normal (3,) is a unit vector that points up; sigma_m is its noise [m]."""

    normal: FloatArray
    offset: float
    sigma_m: float = 0.0

    def height(self, points: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
        """Return how far points (..., 3) lie above the plane [m]."""
        n = self.normal.astype(np.float32)
        height = points[..., 0] * n[0] + points[..., 1] * n[1] + points[..., 2] * n[2] - np.float32(self.offset)
        return np.asarray(height, dtype=np.float32)


class _PlaneModel:
    """Plane through points (N, 3), in the form that skimage's ransac wants."""

    def __init__(self) -> None:
        self.params: tuple[FloatArray, float] | None = None

    def estimate(self, data: FloatArray) -> bool:
        if data.shape == (3, 3):
            (ax, ay, az), (bx, by, bz) = (data[1] - data[0]).tolist(), (data[2] - data[0]).tolist()
            normal = np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
            length = math.sqrt(float(normal @ normal))
            if length < TABLE_PLANE.least_area_m2:  # the three lie on a line, or too near one another
                return False
            normal = normal / length
            center = data[0]
        else:
            center = data.mean(axis=0)
            normal = np.linalg.svd(data - center, full_matrices=False)[2][-1]
        self.params = (normal, float(normal @ center))
        return True

    @classmethod
    def from_estimate(cls, data: FloatArray) -> _PlaneModel:
        model = cls()
        model.estimate(data)
        return model

    def __bool__(self) -> bool:
        """Whether there is a plane; ransac passes over the others."""
        return self.params is not None

    def residuals(self, data: FloatArray) -> FloatArray:
        assert self.params is not None  # noqa: S101  (set by estimate, as ransac promises)
        normal, offset = self.params
        return np.asarray(np.abs(data @ normal - offset))


def find_table_plane(
    flat: FloatArray, up: FloatArray, *, gravity_known: bool, seed: int = 0, options: TablePlaneOptions = TABLE_PLANE
) -> Plane:
    """Find the plane of the table among points (N, 3) [m].

    Args:
        options: numbers that tune it.
        flat: the points, about evenly spread over the image.
        up: roughly upwards; exactly so, from the floor at 0, if gravity_known (base frame).
        gravity_known: whether only level planes at the height of tables are looked for.
        seed: of the random samples.

    Raises:
        TableNotFoundError: there is no plane large enough.
    """
    if gravity_known:
        z = flat @ up
        flat = flat[(z > options.least_table_z_m) & (z < options.greatest_table_z_m)]
    rng = np.random.default_rng(seed)
    if len(flat) < options.least_points:
        raise TableNotFoundError("no table seen: too few points with depth; look at the table from 0.4 to 2 m")
    total = len(flat)
    best: Plane | None = None
    best_score = 0.0
    for _ in range(3):
        if len(flat) < max(100, options.least_share * total):
            break
        plane = _fit_once(flat, up, gravity_known=gravity_known, rng=rng, options=options)
        if plane is None:
            break
        inlier = np.abs(flat @ plane.normal - plane.offset) < options.inlier_m
        # Level planes are likelier tables; of two, the one nearer to the camera (higher) is the table, not the floor.
        score = inlier.sum() * (0.3 + abs(float(plane.normal @ up)))
        if inlier.sum() >= options.least_share * total and (
            best is None or _likelier(plane, score, best, best_score, options=options)
        ):
            best, best_score = plane, score
        if gravity_known and inlier.sum() > 0.5 * total:
            break
        flat = flat[~inlier]
    if best is None:
        raise TableNotFoundError("no table seen: no level surface is large enough; turn the camera to the table")
    return best


def _likelier(
    plane: Plane, score: float, other: Plane, other_score: float, *, options: TablePlaneOptions = TABLE_PLANE
) -> bool:
    """Whether a plane is the table rather than another one: of two level ones the higher, if it is not much smaller."""
    parallel = float(plane.normal @ other.normal) > np.cos(np.radians(10.0))
    if parallel and abs(plane.offset - other.offset) > options.storey_m:
        higher = plane.offset > other.offset
        return score > options.floor_share * other_score if higher else other_score < options.floor_share * score
    return score > other_score


def _fit_once(
    flat: FloatArray,
    up: FloatArray,
    *,
    gravity_known: bool,
    rng: np.random.Generator,
    options: TablePlaneOptions = TABLE_PLANE,
) -> Plane | None:
    limit = options.least_up_in_base if gravity_known else options.least_up_in_camera
    sample: FloatArray = flat[rng.choice(len(flat), min(options.sample, len(flat)), replace=False)]

    def level(model: _PlaneModel, *_: object) -> bool:
        return model.params is not None and abs(float(model.params[0] @ up)) > limit

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "no inliers" is an answer here
        model, inliers = ransac(
            sample,
            _PlaneModel,
            min_samples=3,
            residual_threshold=options.inlier_m,
            is_model_valid=level,
            max_trials=120,
            stop_probability=0.999,
            rng=rng,
        )
    if not model or inliers is None or inliers.sum() < options.least_inliers:
        return None
    normal, offset = model.params
    # In the camera's own frame the camera is at the origin, and sees the table from above whichever way up it is held.
    if normal @ up < 0.0 if gravity_known else offset > 0.0:
        normal, offset = -normal, -offset
    return _refined(flat[:: max(1, len(flat) // options.refining)], normal, offset, options=options)


def _refined(flat: FloatArray, normal: FloatArray, offset: float, *, options: TablePlaneOptions = TABLE_PLANE) -> Plane:
    """Fit the plane to what lies on it, not to the floors of plates and pans a few millimetres above it.

    Objects only ever add points above the table, so the table is the lowest dense layer: its level is the mode of the
    heights, its noise the spread below the mode.
    """
    reach, sigma = options.inlier_m, options.inlier_m
    for _ in range(4):
        height = flat @ normal - offset
        level, sigma = lowest_layer(height[np.abs(height) < 2.0 * options.inlier_m], options=options)
        reach = float(np.clip(2.2 * sigma, 0.0015, 0.02))
        near = flat[np.abs(height - level) < reach]
        if len(near) < options.few_points:
            break
        center = near.mean(axis=0)
        before = normal, offset
        _, vectors = np.linalg.eigh((near - center).T @ (near - center))
        normal = vectors[:, 0] if vectors[:, 0] @ normal > 0.0 else -vectors[:, 0]
        offset = float(normal @ center)
        if np.abs(normal - before[0]).max() < options.settled_rad and abs(offset - before[1]) < options.settled_rad:
            break
    return Plane(normal, float(offset), sigma)


def lowest_layer(heights: npt.NDArray[np.floating], *, options: TablePlaneOptions = TABLE_PLANE) -> tuple[float, float]:
    """Return the level of the table among heights (N,) about it, and the noise, judged by what lies below that [m].

    Where two layers are dense (a large plate on a small table), the lower one of comparable weight is the table.
    """
    if len(heights) < options.few_points:
        return 0.0, options.inlier_m
    bins = ((heights + options.layer_m) * (1.0 / options.layer_bin_m)).astype(np.int32)[
        np.abs(heights) < options.layer_m
    ]
    counts = np.bincount(bins, minlength=round(2.0 * options.layer_m / options.layer_bin_m))
    smooth = np.convolve(counts, [0.25, 0.5, 0.25], mode="same")
    dense = np.flatnonzero(smooth > 0.5 * smooth.max())
    first = int(dense[0])
    run = dense[dense - first == np.arange(len(dense))]
    peak = int(run[smooth[run].argmax()])
    level = (peak + 0.5) * options.layer_bin_m - options.layer_m
    level = quantile(
        heights[np.abs(heights - level) < options.fine_layer_m], 50
    )  # finer than the bins, where noise is small
    below = heights[heights <= level]
    sigma = 1.4826 * (level - quantile(below, 50)) if len(below) > options.least_below else options.inlier_m
    return level, max(sigma, 0.0002)
