# SPDX-License-Identifier: Apache-2.0
"""Circles in clouds seen from above: the edge of hollow things and the outline of round ones."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from uncom_tiago_exec.types import FloatArray

_VOTERS = 200  # points that choose among circles


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle on the table: centre (2,), radius [m]."""

    centre: FloatArray
    radius: float


def fit_circle(points: FloatArray) -> Circle:
    """Fit a circle to points (N, 2), N >= 3, by linear least squares (Kasa 1976)."""
    mean = points.mean(axis=0)
    local = points - mean
    a = np.column_stack([2.0 * local, np.ones(len(local))])
    (x, y, c), *_ = np.linalg.lstsq(a, (local**2).sum(axis=1), rcond=None)
    return Circle(mean + np.array([x, y]), float(np.sqrt(max(c + x * x + y * y, 1e-12))))


def robust_circle(
    points: FloatArray, tolerance: float, radius_range: tuple[float, float], seed: int = 0
) -> tuple[Circle, float] | None:
    """Return the circle with most points (N, 2) within `tolerance`, and the share of its round they cover, or None."""
    if len(points) < 8:
        return None
    rng = np.random.default_rng(seed)
    centres, radii = _through_three(points[rng.integers(0, len(points), (120, 3))])
    usable = (radii >= radius_range[0]) & (radii <= radius_range[1])
    if not usable.any():
        return None
    voters = points[:: max(1, len(points) // _VOTERS)]
    x, y = (voters - centres[usable, None]).transpose(2, 0, 1)
    votes = np.count_nonzero(np.abs(np.sqrt(x * x + y * y) - radii[usable, None]) < tolerance, axis=1)
    k = np.flatnonzero(usable)[int(votes.argmax())]
    best = np.abs(np.linalg.norm(points - centres[k], axis=1) - radii[k]) < tolerance
    if best.sum() < 8:
        return None
    circle = fit_circle(points[best])
    if not radius_range[0] <= circle.radius <= radius_range[1]:
        return None
    close = np.abs(np.linalg.norm(points - circle.centre, axis=1) - circle.radius) < tolerance
    return circle, coverage(points[close], circle.centre)


def _through_three(triples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centres (K, 2) and radii (K,) of the circles through triples (K, 3, 2); infinite radius if on a line."""
    a, b, c = triples[:, 0], triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0]
    cross = 2.0 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    safe = np.where(np.abs(cross) < 1e-12, np.inf, cross)
    bb, cc = (b**2).sum(axis=1), (c**2).sum(axis=1)
    offset = np.column_stack([(c[:, 1] * bb - b[:, 1] * cc) / safe, (b[:, 0] * cc - c[:, 0] * bb) / safe])
    radius = np.where(np.isinf(safe), np.inf, np.linalg.norm(offset, axis=1))
    return a + offset, radius


def coverage(points: FloatArray, centre: FloatArray) -> float:
    """Return the share (0 to 1) of directions from `centre` in which there are points (N, 2)."""
    if len(points) == 0:
        return 0.0
    angles = np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0])
    return float(len(np.unique(np.floor((angles + np.pi) / (2.0 * np.pi) * 24).astype(int) % 24)) / 24.0)


def fit_rim(cloud: FloatArray, table_z: float) -> Circle | None:
    """Return the outer edge of an opening in visible points (N, 3), or None if the thing is not hollow.

    Hollow means: high points form a round edge, and what is seen inside the edge lies clearly lower.
    """
    top = float(np.quantile(cloud[:, 2], 0.99))
    height = top - table_z
    if height < 0.008 or len(cloud) < 40:
        return None
    band = min(0.012, max(0.005, 0.3 * height))
    high = cloud[cloud[:, 2] > top - band, :2]
    found = robust_circle(high, 0.005, (0.02, 0.2))
    if found is None or found[1] < 0.7:
        return None
    circle = found[0]
    distance = np.linalg.norm(cloud[:, :2] - circle.centre, axis=1)
    inside = distance < 0.7 * circle.radius
    drop = top - cloud[inside, 2]
    area = np.pi * (0.7 * circle.radius) ** 2
    covered = inside.sum() * 0.004**2 / area
    low_share = float((drop > max(0.004, min(0.015, 0.35 * height))).mean()) if inside.any() else 1.0
    if inside.any() and covered > 0.05 and low_share < 0.75:
        return None
    # the top of a solid thing would be seen: nothing inside at all is an opening too deep to look into
    near = np.abs(distance - circle.radius) < 0.008
    outer = float(np.quantile(distance[near & (cloud[:, 2] > top - band)], 0.9))
    return Circle(circle.centre, max(circle.radius, outer))


def fit_round(cloud: FloatArray, table_z: float) -> Circle | None:
    """Return the footprint of an upright round thing (can, bottle, ball) in visible points (N, 3), or None."""
    ball = _ball(cloud, table_z)
    if ball is not None:
        return ball
    xy = cloud[:, :2]
    origin = xy.mean(axis=0)
    corners = cv2.convexHull((xy - origin).astype(np.float32))[:, 0].astype(float) + origin
    if len(corners) < 3:
        return None
    outline = _along(np.vstack([corners, corners[:1]]), 0.003)
    found = robust_circle(outline, 0.003, (0.015, 0.12))
    if found is None:
        return None
    circle, share = found
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(outline.T)))
    extent = np.ptp(xy, axis=0).max()
    if share < 0.6 or extent > 2.0 * circle.radius + 0.012 or spread[1] > 1.15 * spread[0]:
        return None
    return circle


def _ball(cloud: FloatArray, table_z: float) -> Circle | None:
    """Return the outline of a ball that rests on the table."""
    mean = cloud.mean(axis=0)
    local = cloud - mean
    a = np.column_stack([2.0 * local, np.ones(len(local))])
    solution, *_ = np.linalg.lstsq(a, (local**2).sum(axis=1), rcond=None)
    centre = mean + solution[:3]
    radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 1e-12)))
    rms = float(np.sqrt(np.mean((np.linalg.norm(cloud - centre, axis=1) - radius) ** 2)))
    if rms > 0.0025 or not 0.015 < radius < 0.07 or abs(centre[2] - table_z - radius) > 0.012:
        return None
    return Circle(centre[:2], radius)


def _along(polygon: FloatArray, step: float) -> FloatArray:
    pieces = []
    for a, b in pairwise(polygon):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / step)))
        pieces.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.vstack(pieces)
