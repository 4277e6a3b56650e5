# SPDX-License-Identifier: Apache-2.0
"""Circles in clouds seen from above: the edge of hollow objects and the outline of round ones."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from uncom_perception.types import LEAST_CORNERS

from uncom_tiago_exec.scene.options import CIRCLE_FITTING, RIM, ROUND, CircleFittingOptions, RimOptions, RoundOptions
from uncom_tiago_exec.types import FloatArray


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
    points: FloatArray,
    tolerance_m: float,
    radius_range_m: tuple[float, float],
    seed: int = 0,
    options: CircleFittingOptions = CIRCLE_FITTING,
) -> tuple[Circle, float] | None:
    """Return the circle that most points are on, and the share of directions they cover; None if there is none.

    The circle is the best of those through three random points (RANSAC, Fischler and Bolles 1981), fitted again to the
    points near it.

    Args:
        points: (N, 2) [m].
        tolerance_m: from the circle that points on it may be [m].
        radius_range_m: least and greatest radius [m].
        seed: of the random triples.
        options: number of triples and voters.
    """
    if len(points) < options.least_points:
        return None
    rng = np.random.default_rng(seed)
    centres, radii = _through_three(points[rng.integers(0, len(points), (options.triples, 3))])
    usable = (radii >= radius_range_m[0]) & (radii <= radius_range_m[1])
    if not usable.any():
        return None
    voters = points[:: max(1, len(points) // options.voters)]
    x, y = (voters - centres[usable, None]).transpose(2, 0, 1)
    votes = np.count_nonzero(np.abs(np.sqrt(x * x + y * y) - radii[usable, None]) < tolerance_m, axis=1)
    k = np.flatnonzero(usable)[int(votes.argmax())]
    best = np.abs(np.linalg.norm(points - centres[k], axis=1) - radii[k]) < tolerance_m
    if best.sum() < options.least_points:
        return None
    circle = fit_circle(points[best])
    if not radius_range_m[0] <= circle.radius <= radius_range_m[1]:
        return None
    close = np.abs(np.linalg.norm(points - circle.centre, axis=1) - circle.radius) < tolerance_m
    return circle, coverage(points[close], circle.centre, options.sectors)


def _through_three(triples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centres (K, 2) and radii (K,) of the circles through triples (K, 3, 2); infinite radius if on a line."""
    a, b, c = triples[:, 0], triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0]
    cross = 2.0 * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    safe = np.where(np.isclose(cross, 0.0, rtol=0.0, atol=1e-12), np.inf, cross)
    bb, cc = (b**2).sum(axis=1), (c**2).sum(axis=1)
    offset = np.column_stack([(c[:, 1] * bb - b[:, 1] * cc) / safe, (b[:, 0] * cc - c[:, 0] * bb) / safe])
    radius = np.where(np.isinf(safe), np.inf, np.linalg.norm(offset, axis=1))
    return a + offset, radius


def coverage(points: FloatArray, centre: FloatArray, sectors: int) -> float:
    """Return the share (0 to 1) of `sectors` directions from a centre (2,) in which there are points (N, 2)."""
    if len(points) == 0:
        return 0.0
    angles = np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0])
    filled = np.unique(np.floor((angles + np.pi) / (2.0 * np.pi) * sectors).astype(int) % sectors)
    return float(len(filled) / sectors)


def fit_rim(cloud: FloatArray, table_z: float, options: RimOptions = RIM) -> Circle | None:
    """Return the outer edge of an opening in visible points (N, 3), or None if the object is not hollow.

    Hollow means: high points form a round edge, and what is seen inside the edge lies clearly lower.
    """
    top = float(np.quantile(cloud[:, 2], 0.99))
    height = top - table_z
    if height < options.least_height_m or len(cloud) < options.least_points:
        return None
    band = min(options.most_band_m, max(options.least_band_m, options.band_share * height))
    high = cloud[cloud[:, 2] > top - band, :2]
    found = robust_circle(high, options.tolerance_m, options.radius_range_m)
    if found is None or found[1] < options.least_coverage:
        return None
    circle = found[0]
    distance = np.linalg.norm(cloud[:, :2] - circle.centre, axis=1)
    inside = distance < options.inside_share * circle.radius
    drop = top - cloud[inside, 2]
    area = np.pi * (options.inside_share * circle.radius) ** 2
    covered = inside.sum() * options.point_side_m**2 / area
    lower = max(options.least_drop_m, min(options.most_drop_m, options.drop_share * height))
    low_share = float((drop > lower).mean()) if inside.any() else 1.0
    if inside.any() and covered > options.seen_inside and low_share < options.least_low_share:
        return None
    # the top of a solid object would be seen: nothing inside at all is an opening too deep to look into
    near = np.abs(distance - circle.radius) < options.edge_width_m
    outer = float(np.quantile(distance[near & (cloud[:, 2] > top - band)], options.outer_quantile))
    return Circle(circle.centre, max(circle.radius, outer))


def fit_round(cloud: FloatArray, table_z: float, options: RoundOptions = ROUND) -> Circle | None:
    """Return the footprint of an upright round object (can, bottle, ball) in visible points (N, 3), or None."""
    ball = _ball(cloud, table_z, options)
    if ball is not None:
        return ball
    xy = cloud[:, :2]
    origin = xy.mean(axis=0)
    corners = cv2.convexHull((xy - origin).astype(np.float32))[:, 0].astype(float) + origin
    if len(corners) < LEAST_CORNERS:
        return None
    outline = _resampled(np.vstack([corners, corners[:1]]), options.outline_step_m)
    found = robust_circle(outline, options.tolerance_m, options.radius_range_m)
    if found is None:
        return None
    circle, share = found
    spread = np.sqrt(np.linalg.eigvalsh(np.cov(outline.T)))
    extent = np.ptp(xy, axis=0).max()
    elongated = spread[1] > options.most_elongation * spread[0]
    if share < options.least_coverage or extent > 2.0 * circle.radius + options.beyond_m or elongated:
        return None
    return circle


def _ball(cloud: FloatArray, table_z: float, options: RoundOptions) -> Circle | None:
    """Return the outline of a ball that rests on the table; None if the points (N, 3) are no ball."""
    mean = cloud.mean(axis=0)
    local = cloud - mean
    a = np.column_stack([2.0 * local, np.ones(len(local))])
    solution, *_ = np.linalg.lstsq(a, (local**2).sum(axis=1), rcond=None)
    centre = mean + solution[:3]
    radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 1e-12)))
    rms = float(np.sqrt(np.mean((np.linalg.norm(cloud - centre, axis=1) - radius) ** 2)))
    least, greatest = options.ball_radius_range_m
    above = abs(centre[2] - table_z - radius)
    if rms > options.ball_error_m or not least < radius < greatest or above > options.ball_above_m:
        return None
    return Circle(centre[:2], radius)


def _resampled(polygon: FloatArray, step: float) -> FloatArray:
    """Return points along a polyline (N, 2), at most `step` [m] apart."""
    pieces = []
    for a, b in pairwise(polygon):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / step)))
        pieces.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.vstack(pieces)
