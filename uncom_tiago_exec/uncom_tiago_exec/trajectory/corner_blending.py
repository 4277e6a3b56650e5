# SPDX-License-Identifier: Apache-2.0
r"""Replaces the corners of a polyline by parabolic blends, so that the direction of the path is continuous.

A blend begins and ends at the distance r from the corner P. With the unit directions d1 and d2 before and after it,

$$q(s) = P - r d_1 + s d_1 + \frac{s^2}{2} \frac{d_2 - d_1}{2 r}, \quad 0 \le s \le 2 r,$$

which ends in $P + r d_2$ with the derivative $d_2$. The second derivative is constant, and the path cuts the corner by
$r |d_2 - d_1| / 4$. These are the parabolic blends of textbook trajectories (Craig, Introduction to Robotics), applied
to the geometric path as the circular blends of Kunz and Stilman (2012) are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.trajectory.options import TIMING, TimingOptions
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class PathGrid:
    """A path on intervals of its parameter s, in each of which the second derivative is constant.

    Attributes:
        s: values of the parameter (N,), the ends of the intervals.
        q: joint positions there (N, J).
        first_start: derivative by s at the start of each interval (N - 1, J).
        first_end: derivative by s at the end of each interval (N - 1, J).
        second: second derivative by s in each interval (N - 1, J).
    """

    s: FloatArray
    q: FloatArray
    first_start: FloatArray
    first_end: FloatArray
    second: FloatArray


@dataclass(frozen=True, slots=True)
class _Piece:
    """A straight or parabolic piece of path: length, and at its start (J,) position, first and second derivative."""

    length: float
    start: FloatArray
    first: FloatArray
    second: FloatArray


def blend_corners(
    waypoints: FloatArray, scale: FloatArray, radius: float | None = None, *, options: TimingOptions = TIMING
) -> PathGrid:
    """Return the path through waypoints with blended corners, on a grid.

    A blend never takes more than half of a segment, so that start and end of the path stay where they are.

    Args:
        waypoints: joint positions (N, J), N >= 2.
        scale: by which joint coordinates are divided to measure lengths (J,).
        radius: greatest length of a blend on either side of a corner; that of the options if None.
        options: numbers that tune it.
    """
    radius = options.corner_radius if radius is None else radius
    points = _without_repeats(np.asarray(waypoints, dtype=float), scale, options=options)
    if len(points) <= 1:
        zero = np.zeros((0, points.shape[1]))
        return PathGrid(np.zeros(1), points[:1], zero, zero, zero)
    delta = np.diff(points, axis=0)
    lengths = np.linalg.norm(delta / scale, axis=1)
    directions = delta / lengths[:, None]
    cuts = np.zeros(len(points))
    cuts[1:-1] = np.minimum(radius, options.corner_share * np.minimum(lengths[:-1], lengths[1:]))
    pieces: list[_Piece] = []
    for i, direction in enumerate(directions):
        straight = lengths[i] - cuts[i] - cuts[i + 1]
        pieces.append(_Piece(straight, points[i] + cuts[i] * direction, direction, np.zeros_like(direction)))
        if i + 1 < len(directions):
            corner, after = points[i + 1], directions[i + 1]
            curvature = (after - direction) / (2.0 * cuts[i + 1])
            start = corner - cuts[i + 1] * direction
            pieces.append(_Piece(2.0 * cuts[i + 1], start, direction, curvature))
    return _grid_of(pieces, points[-1], options=options)


def _without_repeats(points: FloatArray, scale: FloatArray, *, options: TimingOptions = TIMING) -> FloatArray:
    """Return points (N, J) without those that repeat the one before; lengths are divided by `scale` (J,)."""
    keep = np.r_[True, np.linalg.norm(np.diff(points, axis=0) / scale, axis=1) > options.repeat_length]
    return points[keep]


def _grid_of(pieces: list[_Piece], last: FloatArray, *, options: TimingOptions = TIMING) -> PathGrid:
    """Return the grid of successive pieces that end at `last` (J,)."""
    s, q, first_start, first_end, second = [], [], [], [], []
    offset = 0.0
    for piece in pieces:
        if piece.length < options.empty_length:
            continue
        count = max(2, int(np.ceil(piece.length / options.grid_step)))
        edges = np.linspace(0.0, piece.length, count + 1)
        begin, end = edges[:-1, None], edges[1:, None]
        s.append(offset + edges[:-1])
        q.append(piece.start + piece.first * begin + 0.5 * piece.second * begin**2)
        first_start.append(piece.first + piece.second * begin)
        first_end.append(piece.first + piece.second * end)
        second.append(np.broadcast_to(piece.second, (count, len(piece.second))))
        offset += piece.length
    return PathGrid(
        np.concatenate([*s, [offset]]),
        np.vstack([*q, last[None]]),
        np.vstack(first_start),
        np.vstack(first_end),
        np.vstack(second),
    )
