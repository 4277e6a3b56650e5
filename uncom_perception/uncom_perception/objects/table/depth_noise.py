# SPDX-License-Identifier: Apache-2.0
"""How level the table looks to a real depth camera: its noise over the distance, and the bow of its picture."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uncom_perception.image_arrays import quantile
from uncom_perception.objects.table.options import DEPTH_NOISE, DepthNoiseOptions
from uncom_perception.objects.table.table_plane import lowest_layer

FloatImage = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Noise of heights averaged over 5 x 5 pixels: about level_m, deviation scale * distance² [m], at least floor_m."""

    level_m: float
    scale: float
    floor_m: float

    def least_height(self, depth: FloatImage, least_m: float) -> FloatImage:
        """Return the height (H, W) above which a pixel at a depth (H, W) [m] is no longer table [m]."""
        height = depth * depth
        height *= np.float32(DEPTH_NOISE.noise_factor * self.scale)
        np.maximum(height, np.float32(max(DEPTH_NOISE.noise_factor * self.floor_m, least_m)), out=height)
        height += np.float32(self.level_m)
        return np.asarray(height, dtype=np.float32)


def measure_noise(
    wide: FloatImage, depth: FloatImage, on_table: npt.NDArray[np.bool_], *, options: DepthNoiseOptions = DEPTH_NOISE
) -> NoiseModel:
    """Measure the noise of heights averaged over 5 x 5 pixels (H, W) on table pixels, in bands of distance.

    Objects only add points above the table, so that the spread below its level is noise alone.
    """
    some = on_table[:: options.noise_stride, :: options.noise_stride]
    heights, depths = (
        wide[:: options.noise_stride, :: options.noise_stride][some],
        depth[:: options.noise_stride, :: options.noise_stride][some],
    )
    if len(heights) < options.least_pixels:
        return NoiseModel(0.0, 0.0, 0.002)
    level, floor = lowest_layer(heights)
    edges = np.quantile(depths[:: max(1, len(depths) // 2000)], np.linspace(0.0, 1.0, options.bands + 1))
    scales = []
    for near, far in itertools.pairwise(edges.tolist()):
        band = heights[(depths >= near) & (depths <= far)]
        below = band[band < level]
        if len(below) > options.least_band_pixels:
            scales.append(1.4826 * (level - quantile(below, 50)) / (0.5 * (near + far)) ** 2)
    scale = float(np.median(scales)) if scales else floor
    middle = quantile(depths, 50)
    return NoiseModel(level, min(scale, options.most_noise_m / middle**2), min(0.5 * floor, options.most_noise_m))


def bow(
    height: FloatImage, on_table: npt.NDArray[np.bool_], *, options: DepthNoiseOptions = DEPTH_NOISE
) -> FloatImage | None:
    """Return by how much a flat table (H, W) looks bowed [m], as a surface of second order; None if hardly at all.

    The fit begins with what surely is table and takes in, round by round, what continues it.
    """
    rows, columns = height.shape
    v, u = np.nonzero(np.abs(height[:: options.bow_stride, :: options.bow_stride]) < options.far_off_m)
    sure = on_table[:: options.bow_stride, :: options.bow_stride][v, u]
    if np.count_nonzero(sure) < options.least_pixels:
        return None
    values = height[:: options.bow_stride, :: options.bow_stride][v, u].astype(float)
    terms = _terms(2.0 * u * options.bow_stride / columns - 1.0, 2.0 * v * options.bow_stride / rows - 1.0)
    keep = sure
    coefficients, fitted, spread = np.zeros(6), values, options.fit_reach_m
    for _ in range(6):
        kept = terms[keep]  # few, well scaled terms: the normal equations are as good, and quick
        coefficients = np.linalg.lstsq(kept.T @ kept, kept.T @ values[keep], rcond=None)[0]
        fitted = terms @ coefficients
        if float(np.ptp(fitted[sure])) < options.least_gain * options.least_bow_m:
            return None
        rest = values - fitted
        spread = 1.4826 * quantile(np.abs(rest[keep]), 50)
        keep = (rest > -3.0 * spread) & (rest < 2.0 * spread)
        if np.count_nonzero(keep) < options.least_fit_pixels:
            return None
    if float(np.ptp(fitted[keep])) < options.least_bow_m or float(np.abs(fitted[keep]).max()) > options.far_off_m:
        return None
    c = coefficients
    ys = (2.0 * np.arange(rows) / rows - 1.0)[:, None]
    xs = (2.0 * np.arange(columns) / columns - 1.0)[None]
    surface = (c[0] + c[2] * ys + c[5] * ys * ys) + (c[1] * xs + c[3] * xs * xs) + c[4] * ys * xs
    return np.asarray(surface, dtype=np.float32)


def _terms(x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
