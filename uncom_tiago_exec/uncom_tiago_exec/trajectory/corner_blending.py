# SPDX-License-Identifier: Apache-2.0
"""Rounds the corners of a polyline: straight pieces joined by parabolas, so that its direction is continuous."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.trajectory.options import TIMING, TimingOptions
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class PathGrid:
    """A path sampled on intervals of its parameter s on which the second derivative is constant.

    s (N,), q (N, J); first derivative at the start and at the end of each interval (N-1, J), second (N-1, J).
    """

    s: FloatArray
    q: FloatArray
    first_start: FloatArray
    first_end: FloatArray
    second: FloatArray


def blend(waypoints: FloatArray, scale: FloatArray, radius: float = 0.25, step: float = 0.04) -> PathGrid:
    """Blend waypoints (N, J), N >= 2, with parabolas of at most `radius` on both sides of each corner.

    Lengths are measured in joint coordinates divided by `scale` (J,); `step` is the spacing of the grid.
    A blend never takes more than half of a segment, so that start and end stay where they are.
    """
    points = _without_repeats(np.asarray(waypoints, dtype=float), scale)
    if len(points) <= 1:
        zero = np.zeros((0, points.shape[1]))
        return PathGrid(np.zeros(1), points[:1], zero, zero, zero)
    delta = np.diff(points, axis=0)
    lengths = np.linalg.norm(delta / scale, axis=1)
    directions = delta / lengths[:, None]
    cuts = np.zeros(len(points))
    cuts[1:-1] = np.minimum(radius, 0.499 * np.minimum(lengths[:-1], lengths[1:]))
    pieces: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []  # length, start, first, second
    for i, direction in enumerate(directions):
        straight = lengths[i] - cuts[i] - cuts[i + 1]
        pieces.append((straight, points[i] + cuts[i] * direction, direction, np.zeros_like(direction)))
        if i + 1 < len(directions):
            corner, after = points[i + 1], directions[i + 1]
            bend = (after - direction) / (2.0 * cuts[i + 1])
            pieces.append((2.0 * cuts[i + 1], corner - cuts[i + 1] * direction, direction, bend))
    return _grid(pieces, points[-1], step)


def _without_repeats(points: FloatArray, scale: FloatArray, *, options: TimingOptions = TIMING) -> FloatArray:
    """Return the points (N, J) without those that repeat the one before; lengths in joint coordinates over `scale`."""
    keep = np.r_[True, np.linalg.norm(np.diff(points, axis=0) / scale, axis=1) > options.repeat_length]
    return points[keep]


def _grid(
    pieces: list[tuple[float, FloatArray, FloatArray, FloatArray]],
    last: FloatArray,
    step: float,
    *,
    options: TimingOptions = TIMING,
) -> PathGrid:
    """Return the grid of the pieces (length, start, first and second derivative) that end at `last` (J,)."""
    s, q, first_start, first_end, second = [], [], [], [], []
    offset = 0.0
    for length, start, first, bend in pieces:
        if length < options.empty_length:
            continue
        count = max(2, int(np.ceil(length / step)))
        edges = np.linspace(0.0, length, count + 1)
        begin, end = edges[:-1, None], edges[1:, None]
        s.append(offset + edges[:-1])
        q.append(start + first * begin + 0.5 * bend * begin**2)
        first_start.append(first + bend * begin)
        first_end.append(first + bend * end)
        second.append(np.broadcast_to(bend, (count, len(bend))))
        offset += length
    return PathGrid(
        np.concatenate([*s, [offset]]),
        np.vstack([*q, last[None]]),
        np.vstack(first_start),
        np.vstack(first_end),
        np.vstack(second),
    )
