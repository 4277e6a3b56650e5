# SPDX-License-Identifier: Apache-2.0
"""Times a path so that velocity, acceleration and jerk of every joint stay within their limits.

1. The corners are rounded (corner_blending.py): the motion does not stop at waypoints.
2. The fastest speed along the path under velocity and acceleration limits is found by reachability analysis on a
   grid (Pham and Pham 2018, TOPP-RA); the limits are linear between grid points, so they hold there too.
3. The motion is averaged over a sliding window. An average never exceeds the limits of what it averages, and with
   window w the jerk is at most 2 a_max / w; the path changes by at most a_max w^2 / 24, well under a margin.

A straight line needs none of this: Ruckig times it exactly (rest_to_rest.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.trajectory.corner_blending import PathGrid, blend
from uncom_tiago_exec.trajectory.options import TIMING, TimingOptions
from uncom_tiago_exec.trajectory.rest_to_rest import is_straight, time_straight
from uncom_tiago_exec.types import FloatArray, Trajectory


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Per joint (J,): velocity [rad/s, m/s], acceleration [../s^2]; jerk is at most jerk_ratio [1/s] times that."""

    velocity: FloatArray
    acceleration: FloatArray
    jerk_ratio: float = 12.0

    @property
    def jerk(self) -> FloatArray:
        """Jerk limits (J,) [../s^3]."""
        return self.jerk_ratio * self.acceleration

    def scaled(self, speed: float) -> MotionLimits:
        """Return the limits of the same motion at `speed` times its pace."""
        return MotionLimits(self.velocity * speed, self.acceleration * speed**2, self.jerk_ratio * speed)


def time_path(
    joint_names: tuple[str, ...],
    waypoints: FloatArray,
    limits: MotionLimits,
    rate_hz: float = 50.0,
    radius: float = 0.25,
    *,
    options: TimingOptions = TIMING,
) -> Trajectory:
    """Return the motion along waypoints (N, J) from rest to rest, sampled at `rate_hz`.

    Raises:
        PlanningError: the waypoints are not finite.
    """
    if not np.isfinite(waypoints).all():
        raise PlanningError("a path holds values that are not numbers; plan again")
    if is_straight(waypoints):
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        return Trajectory(joint_names, *time_straight(waypoints[0], waypoints[-1], bounds, rate_hz))
    grid = blend(waypoints, limits.velocity, radius)
    if len(grid.s) <= 1:
        return _rest(joint_names, grid.q[0])
    squared = _speed_profile(grid, limits, options=options)
    times, positions = _integrate(grid, squared, options=options)
    window = 2.02 / limits.jerk_ratio
    return _smooth(joint_names, times, positions, window, rate_hz, options=options)


def _rest(joint_names: tuple[str, ...], q: FloatArray) -> Trajectory:
    positions = np.vstack([q, q])
    return Trajectory(joint_names, np.array([0.0, 0.02]), positions, np.zeros_like(positions))


def _speed_profile(grid: PathGrid, limits: MotionLimits, *, options: TimingOptions = TIMING) -> FloatArray:
    """Return the squared path speed at each grid point (N,): backward controllable sets, then greedy forward."""
    count, ds = len(grid.s), np.diff(grid.s)
    # |a u + b x| <= c at both ends of each interval, with x the squared speed at its start and u half of how it grows
    a = np.concatenate([grid.first_start, grid.first_end + 2.0 * ds[:, None] * grid.second], axis=1)
    b = np.concatenate([grid.second, grid.second], axis=1)
    c = np.tile(limits.acceleration, 2)
    # the direction turns evenly within an interval: what it is at either end bounds the speed at both
    steepest = np.maximum(np.abs(grid.first_start), np.abs(grid.first_end))
    allowed = (limits.velocity / np.maximum(steepest, 1e-9)).min(axis=1) ** 2
    fastest = np.minimum(np.append(allowed, np.inf), np.append(np.inf, allowed))
    flat = np.abs(a) <= options.flat_slope
    safe = np.where(flat, 1.0, a)
    slope, room = np.where(flat, 0.0, b / safe), np.where(flat, np.inf, c / np.abs(safe))
    # u <= room - slope x and u >= -room - slope x: each upper with each lower bound, and what stays still, bound x
    own = _smallest(room[:, :, None] + room[:, None, :], slope[:, :, None] - slope[:, None, :], (1, 2), options=options)
    own = np.minimum(own, _smallest(np.broadcast_to(c, b.shape), np.where(flat, np.abs(b), 0.0), (1,), options=options))
    own = np.minimum(
        own, _smallest(room, slope - 0.5 / ds[:, None], (1,), options=options)
    )  # x at the end is not negative
    own = np.minimum(own, fastest[:-1])
    reach = np.zeros(count)
    steepness = 0.5 / ds[:, None] - slope  # x at the end is at most what is allowed there
    rising = (steepness > options.flat_slope) & ~flat
    steepness = np.where(rising, steepness, 1.0)
    for i in range(count - 2, -1, -1):
        after = np.where(rising[i], (0.5 / ds[i] * reach[i + 1] + room[i]) / steepness[i], np.inf)
        reach[i] = max(0.0, min(float(own[i]), float(after.min())))
    squared = np.zeros(count)
    for i in range(count - 1):
        u = float((room[i] - slope[i] * squared[i]).min())
        squared[i + 1] = max(0.0, min(squared[i] + 2.0 * ds[i] * u, float(reach[i + 1])))
    return squared


def _smallest(
    room: FloatArray, slope: FloatArray, axes: tuple[int, ...], *, options: TimingOptions = TIMING
) -> FloatArray:
    """Return the largest x with slope x <= room for all along the axes."""
    rising = slope > options.flat_slope
    return np.asarray(np.where(rising, room / np.where(rising, slope, 1.0), np.inf).min(axis=axes))


def _integrate(
    grid: PathGrid, squared: FloatArray, *, options: TimingOptions = TIMING
) -> tuple[FloatArray, FloatArray]:
    """Return fine times (M,) and positions (M, J) of the motion with constant path acceleration per interval."""
    speed = np.sqrt(squared)
    ds = np.diff(grid.s)
    total = speed[:-1] + speed[1:]
    if (total <= options.least_speed).any():
        raise PlanningError("a path cannot be timed: it stops on its way; plan again")
    spans = 2.0 * ds / total
    knots = np.concatenate([[0.0], np.cumsum(spans)])
    times = np.arange(0.0, knots[-1], options.step_s)
    interval = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(ds) - 1)
    local = times - knots[interval]
    gain = (squared[1:] - squared[:-1]) / (2.0 * ds)
    along = (speed[:-1][interval] * local + 0.5 * gain[interval] * local**2)[:, None]
    positions = grid.q[:-1][interval] + grid.first_start[interval] * along + 0.5 * grid.second[interval] * along**2
    return np.append(times, knots[-1]), np.vstack([positions, grid.q[-1]])


def _smooth(
    joint_names: tuple[str, ...],
    times: FloatArray,
    positions: FloatArray,
    window: float,
    rate_hz: float,
    *,
    options: TimingOptions = TIMING,
) -> Trajectory:
    """Average over a sliding window and sample."""
    width = max(2, round(window / options.step_s))
    even = np.arange(0.0, times[-1] + options.step_s, options.step_s)
    fine = np.column_stack([np.interp(even, times, column) for column in positions.T])
    padded = np.vstack([np.repeat(fine[:1], width, axis=0), fine, np.repeat(fine[-1:], width + 1, axis=0)])
    total = np.vstack(
        [np.zeros((1, fine.shape[1])), np.cumsum(padded[1:] + padded[:-1], axis=0) * (0.5 * options.step_s)]
    )
    span = width * options.step_s
    averaged = (total[width:] - total[:-width]) / span
    velocity = (padded[width:] - padded[:-width]) / span
    clock = np.arange(len(averaged)) * options.step_s
    end = clock[-1]
    samples = np.append(np.arange(0.0, end - 0.25 / rate_hz, 1.0 / rate_hz), end)
    q = np.column_stack([np.interp(samples, clock, column) for column in averaged.T])
    v = np.column_stack([np.interp(samples, clock, column) for column in velocity.T])
    q[0], q[-1], v[0], v[-1] = positions[0], positions[-1], 0.0, 0.0
    return Trajectory(joint_names, samples, q, v)
