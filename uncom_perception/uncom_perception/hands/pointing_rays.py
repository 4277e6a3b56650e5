# SPDX-License-Identifier: Apache-2.0
"""From landmarks to a pointing ray, in the image and, with registered depth, in space."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera

from uncom_perception.hands.detection.detector import RawHand
from uncom_perception.hands.options import POINTING_RAY, PointingRayOptions
from uncom_perception.image_arrays import FloatArray
from uncom_perception.types import MetricRay, PointingRay

DepthImage = npt.NDArray[np.float32]


def image_ray(
    hand: RawHand, line: tuple[int, ...], style: str, *, options: PointingRayOptions = POINTING_RAY
) -> PointingRay | None:
    """Return the ray of a hand in the image from the first to the last landmark of a line; None if it has no length.

    Source: paper, section III-E (landmarks 5 to 8).
    """
    origin, tip = hand.landmarks[line[0], :2], hand.landmarks[line[-1], :2]
    length = float(np.linalg.norm(tip - origin))
    if length < options.least_length_px:
        return None
    direction = (tip - origin) / length
    noise = max(1.0, options.landmark_noise * hand.size_px) * math.sqrt(2.0)
    sigma = math.hypot(math.atan2(noise, length), options.systematic_rad)
    return PointingRay(
        (float(origin[0]), float(origin[1])),
        (float(tip[0]), float(tip[1])),
        (float(direction[0]), float(direction[1])),
        sigma,
        style=style,
    )


def metric_ray(
    hand: RawHand,
    line: tuple[int, ...],
    depth: DepthImage,
    camera: PinholeCamera,
    *,
    options: PointingRayOptions = POINTING_RAY,
) -> tuple[MetricRay, float] | None:
    """Return the ray in the camera's optical frame [m] and its standard deviation [rad], or None if depth is too poor.

    A straight finger has an inverse depth that is linear along its image, so a robust line through the inverse depths
    of finger pixels only gives the depth of both ends; holes, edges and the background behind the finger drop out.
    """
    joints = hand.landmarks[list(line), :2]
    share = np.linspace(0.0, 1.0, 25)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))])
    if lengths[-1] < options.least_length_px:
        return None
    pixels = np.column_stack([np.interp(share * lengths[-1], lengths, joints[:, k]) for k in (0, 1)])
    z, spread = _finger_depth(pixels, depth, lengths[-1] / 12.0)
    good = np.isfinite(z)
    if good.sum() < options.least_samples:
        return None
    fit = _robust_line(share[good], 1.0 / z[good])
    if fit is None:
        return None
    inverse_base, slope, sigma_inverse = fit
    ends = 1.0 / np.maximum(np.array([inverse_base, inverse_base + slope]), 1e-3) + options.finger_radius_m
    origin, tip = camera.deproject(joints[[0, -1]], ends)
    length = float(np.linalg.norm(tip - origin))
    if not options.least_line_m < length < options.greatest_line_m:
        return None
    depth_noise = max(sigma_inverse * float(ends.mean()) ** 2, 0.3 * spread, 0.001)
    pixel_noise = max(1.0, options.landmark_noise * hand.size_px) * float(ends.mean()) / camera.fx
    sigma = math.hypot(math.sqrt(2.0) * math.hypot(depth_noise, pixel_noise) / length, options.systematic_rad)
    return MetricRay(origin, tip, (tip - origin) / length), min(sigma, 1.0)


def hand_depth(hand: RawHand, depth: DepthImage) -> float:
    """Return the median depth of the hand's landmarks [m], 0 if unknown."""
    marks = np.round(hand.landmarks[:, :2]).astype(int)
    inside = (marks >= 0).all(axis=1) & (marks[:, 0] < depth.shape[1]) & (marks[:, 1] < depth.shape[0])
    z = depth[marks[inside, 1], marks[inside, 0]]
    z = z[np.isfinite(z) & (z > 0.0)]
    return float(np.median(z)) if len(z) >= POINTING_RAY.least_hand_samples else 0.0


def _finger_depth(pixels: FloatArray, depth: DepthImage, radius: float) -> tuple[FloatArray, float]:
    """Return the depth of the nearest surface about each pixel (NaN: none), and the spread within a patch [m]."""
    height, width = depth.shape
    r = int(np.clip(round(radius), 1, 6))
    around = np.arange(-r, r + 1)
    u, v = (np.round(pixels[:, k]).astype(int)[:, None, None] for k in (0, 1))
    rows, columns = v + around[None, :, None], u + around[None, None, :]
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    patches = depth[rows.clip(0, height - 1), columns.clip(0, width - 1)].astype(np.float32)
    patches = np.where(inside & np.isfinite(patches) & (patches > 0.0), patches, np.float32(np.inf))
    values = np.sort(patches.reshape(len(pixels), -1), axis=1)  # what is not known comes last
    known = np.isfinite(values).sum(axis=1)
    here = ((u >= 0) & (u < width) & (v >= 0) & (v < height)).ravel()
    usable = here & (known >= np.maximum(3, 0.25 * inside.reshape(len(pixels), -1).sum(axis=1)))
    z = np.full(len(pixels), np.nan)
    spreads = []
    for i in np.flatnonzero(usable):
        # The finger is nearer than what is behind it: take the nearest surface, not the nearest pixel.
        own = values[i, : known[i]]
        part, rank = math.modf(0.15 * (len(own) - 1))
        nearest = own[int(rank)] + part * (own[int(rank) + 1] - own[int(rank)])
        near = own[: np.searchsorted(own, nearest + 0.015)]
        z[i] = 0.5 * (near[(len(near) - 1) // 2] + near[len(near) // 2])
        low, high = (near[round(share * (len(near) - 1))] for share in (0.16, 0.84))  # as far apart as two deviations
        spreads.append(0.5 * float(high - low))
    return z, float(np.median(spreads)) if spreads else 0.0


def _robust_line(x: FloatArray, y: FloatArray) -> tuple[float, float, float] | None:
    """Fit y = a + b x by all pairs (Theil-Sen), then least squares on what agrees; returns a, b, sigma of the ends."""
    i, j = np.triu_indices(len(x), 1)
    apart = np.abs(x[j] - x[i]) > POINTING_RAY.least_apart
    if not apart.any():
        return None
    slope = float(np.median((y[j] - y[i])[apart] / (x[j] - x[i])[apart]))
    base = float(np.median(y - slope * x))
    residual = np.abs(y - base - slope * x)
    scale = max(1.4826 * float(np.median(residual)), 1e-3)
    agree = residual < 3.0 * scale
    if agree.sum() < POINTING_RAY.least_samples or np.ptp(x[agree]) < POINTING_RAY.least_line_span:
        return None
    slope, base = np.polyfit(x[agree], y[agree], 1)
    rms = float(np.sqrt(np.mean((y[agree] - base - slope * x[agree]) ** 2)))
    return float(base), float(slope), 2.0 * rms / math.sqrt(agree.sum())
