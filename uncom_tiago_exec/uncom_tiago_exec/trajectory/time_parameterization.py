# SPDX-License-Identifier: Apache-2.0
r"""Times a path so that velocity, acceleration and jerk of every joint stay within their limits.

1. The corners are blended (corner_blending.py), so that the motion does not stop at waypoints.
2. The fastest speed along the path under velocity and acceleration limits is found by reachability analysis on a grid
   (TOPP-RA: Pham and Pham 2018). With the squared path speed $x = \dot s^2$ and the path acceleration $u = \ddot s$,
   $\ddot q = q'(s) u + q''(s) x$ is linear, and so is $x$ from one grid point to the next,
   $x_{i+1} = x_i + 2 \Delta_i u$. As $q''$ is constant in an interval, limits that hold at both of its ends hold in it.
3. The motion is averaged over a sliding window w. An average never exceeds the limits of what it averages; its jerk is
   a difference of accelerations divided by w, at most $2 a_{max} / w$, and positions change by at most
   $a_{max} w^2 / 24$, which is well below a collision margin.

A straight line needs none of this: Ruckig times it exactly (rest_to_rest.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.trajectory.corner_blending import PathGrid, blend_corners
from uncom_tiago_exec.trajectory.options import TIMING, TimingOptions
from uncom_tiago_exec.trajectory.rest_to_rest import is_straight, time_straight
from uncom_tiago_exec.types import FloatArray, Trajectory


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits of the joints.

    Attributes:
        velocity: (J,) [rad/s, m/s].
        acceleration: (J,) [rad/s^2, m/s^2].
        jerk_ratio: limit of the jerk as multiple of that of the acceleration [1/s].
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk_ratio: float = TIMING.jerk_ratio

    @property
    def jerk(self) -> FloatArray:
        """Limits of the jerk (J,) [rad/s^3, m/s^3]."""
        return self.jerk_ratio * self.acceleration

    def scaled(self, speed: float) -> MotionLimits:
        """Return the limits with which the same motion takes 1 / `speed` times as long."""
        return MotionLimits(self.velocity * speed, self.acceleration * speed**2, self.jerk_ratio * speed)


def time_path(
    joint_names: tuple[str, ...],
    waypoints: FloatArray,
    limits: MotionLimits,
    rate_hz: float | None = None,
    radius: float | None = None,
    *,
    options: TimingOptions = TIMING,
) -> Trajectory:
    """Return the motion along a path from rest to rest.

    Args:
        joint_names: of the J joints.
        waypoints: joint positions (N, J).
        limits: of the joints.
        rate_hz: of the samples; that of the options if None.
        radius: greatest length of a blend on either side of a corner, in seconds at full speed; that of the options if
            None.
        options: numbers that tune it.

    Raises:
        PlanningError: a waypoint is not finite, or the path cannot be timed.
    """
    rate_hz = options.rate_hz if rate_hz is None else rate_hz
    if not np.isfinite(waypoints).all():
        raise PlanningError("a path holds values that are not numbers; plan again")
    if is_straight(waypoints, options=options):
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        return Trajectory(joint_names, *time_straight(waypoints[0], waypoints[-1], bounds, rate_hz, options=options))
    grid = blend_corners(waypoints, limits.velocity, radius, options=options)
    if len(grid.s) <= 1:
        return _rest(joint_names, grid.q[0], options=options)
    squared = _speed_profile(grid, limits, options=options)
    times, positions = _integrate(grid, squared, options=options)
    window = options.window_factor / limits.jerk_ratio
    return _average(joint_names, times, positions, window, rate_hz, options=options)


def _rest(joint_names: tuple[str, ...], q: FloatArray, *, options: TimingOptions = TIMING) -> Trajectory:
    """Return a short motion that stays at joint positions (J,)."""
    positions = np.vstack([q, q])
    return Trajectory(joint_names, np.array([0.0, options.rest_s]), positions, np.zeros_like(positions))


def _speed_profile(grid: PathGrid, limits: MotionLimits, *, options: TimingOptions = TIMING) -> FloatArray:
    """Return the greatest squared path speed at each grid point (N,).

    Backwards from the end, the greatest speed from which the end can be reached (the upper end of each controllable
    set); then forwards from rest, always with the greatest acceleration that stays below it.
    """
    count, ds = len(grid.s), np.diff(grid.s)
    # |a u + b x| <= c at both ends of each interval, with x the squared speed at its start
    a = np.concatenate([grid.first_start, grid.first_end + 2.0 * ds[:, None] * grid.second], axis=1)
    b = np.concatenate([grid.second, grid.second], axis=1)
    c = np.tile(limits.acceleration, 2)
    flat = np.abs(a) <= options.flat_slope
    divisor = np.where(flat, 1.0, a)
    # divided by |a|: -bound - slope x <= u <= bound - slope x
    slope, bound = np.where(flat, 0.0, b / divisor), np.where(flat, np.inf, c / np.abs(divisor))
    greatest = _greatest_squared_speed(grid, limits, (a, b, c), (slope, bound), options=options)
    controllable = np.zeros(count)
    steepness = 0.5 / ds[:, None] - slope  # of the next squared speed with the lowest u, which must be controllable
    rising = (steepness > options.flat_slope) & ~flat
    steepness = np.where(rising, steepness, 1.0)
    for i in range(count - 2, -1, -1):
        by_next = np.where(rising[i], (0.5 / ds[i] * controllable[i + 1] + bound[i]) / steepness[i], np.inf)
        controllable[i] = max(0.0, min(float(greatest[i]), float(by_next.min())))
    squared = np.zeros(count)
    for i in range(count - 1):
        u = float((bound[i] - slope[i] * squared[i]).min())
        squared[i + 1] = max(0.0, min(squared[i] + 2.0 * ds[i] * u, float(controllable[i + 1])))
    return squared


def _greatest_squared_speed(
    grid: PathGrid,
    limits: MotionLimits,
    constraint: tuple[FloatArray, FloatArray, FloatArray],
    normalised: tuple[FloatArray, FloatArray],
    *,
    options: TimingOptions = TIMING,
) -> FloatArray:
    """Return the greatest squared speed at the start of each interval (N - 1,) for which some acceleration is allowed.

    Args:
        grid: of the path.
        limits: of the joints.
        constraint: a, b (N - 1, 2 J) and c (2 J,) of |a u + b x| <= c.
        normalised: slope and bound (N - 1, 2 J) of -bound - slope x <= u <= bound - slope x.
        options: numbers that tune it.
    """
    ds = np.diff(grid.s)
    a, b, c = constraint
    slope, bound = normalised
    flat = np.abs(a) <= options.flat_slope
    # the direction changes linearly in an interval: the larger of its ends bounds the speed at both
    steepest = np.maximum(np.abs(grid.first_start), np.abs(grid.first_end))
    allowed = (limits.velocity / np.maximum(steepest, 1e-9)).min(axis=1) ** 2
    by_velocity = np.minimum(np.append(allowed, np.inf), np.append(np.inf, allowed))
    # each upper bound of u has to be above each lower bound
    greatest = _largest_solution(
        bound[:, :, None] + bound[:, None, :], slope[:, :, None] - slope[:, None, :], (1, 2), options=options
    )
    # joints that do not move with u bound x alone
    without_u = np.where(flat, np.abs(b), 0.0)
    greatest = np.minimum(greatest, _largest_solution(np.broadcast_to(c, b.shape), without_u, (1,), options=options))
    # the squared speed at the end of the interval must not become negative
    greatest = np.minimum(greatest, _largest_solution(bound, slope - 0.5 / ds[:, None], (1,), options=options))
    return np.asarray(np.minimum(greatest, by_velocity[:-1]))


def _largest_solution(
    bound: FloatArray, slope: FloatArray, axes: tuple[int, ...], *, options: TimingOptions = TIMING
) -> FloatArray:
    """Return the largest x >= 0 with slope x <= bound for all along the axes; infinity if nothing bounds it."""
    rising = slope > options.flat_slope
    return np.asarray(np.where(rising, bound / np.where(rising, slope, 1.0), np.inf).min(axis=axes))


def _integrate(
    grid: PathGrid, squared: FloatArray, *, options: TimingOptions = TIMING
) -> tuple[FloatArray, FloatArray]:
    """Return times (M,) and positions (M, J) of the motion with these squared path speeds (N,) at the grid points.

    The path acceleration is constant in each interval.
    """
    speed = np.sqrt(squared)
    ds = np.diff(grid.s)
    total = speed[:-1] + speed[1:]
    if (total <= options.least_speed).any():
        raise PlanningError("a path cannot be timed: it stops on its way; plan again")
    durations = 2.0 * ds / total
    knots = np.concatenate([[0.0], np.cumsum(durations)])
    times = np.arange(0.0, knots[-1], options.step_s)
    interval = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(ds) - 1)
    elapsed = times - knots[interval]
    acceleration = (squared[1:] - squared[:-1]) / (2.0 * ds)
    along = (speed[:-1][interval] * elapsed + 0.5 * acceleration[interval] * elapsed**2)[:, None]
    positions = grid.q[:-1][interval] + grid.first_start[interval] * along + 0.5 * grid.second[interval] * along**2
    return np.append(times, knots[-1]), np.vstack([positions, grid.q[-1]])


def _average(
    joint_names: tuple[str, ...],
    times: FloatArray,
    positions: FloatArray,
    window: float,
    rate_hz: float,
    *,
    options: TimingOptions = TIMING,
) -> Trajectory:
    """Return a motion (times (M,), positions (M, J)) averaged over a sliding window [s], and sampled.

    The motion gets longer by the window: it is at rest before its start and after its end.
    """
    width = max(2, round(window / options.step_s))
    even_times = np.arange(0.0, times[-1] + options.step_s, options.step_s)
    even = np.column_stack([np.interp(even_times, times, column) for column in positions.T])
    padded = np.vstack([np.repeat(even[:1], width, axis=0), even, np.repeat(even[-1:], width + 1, axis=0)])
    integral = np.vstack(
        [np.zeros((1, even.shape[1])), np.cumsum(padded[1:] + padded[:-1], axis=0) * (0.5 * options.step_s)]
    )
    span = width * options.step_s
    averaged = (integral[width:] - integral[:-width]) / span
    velocity = (padded[width:] - padded[:-width]) / span
    clock = np.arange(len(averaged)) * options.step_s
    end = clock[-1]
    samples = np.append(np.arange(0.0, end - options.last_interval / rate_hz, 1.0 / rate_hz), end)
    q = np.column_stack([np.interp(samples, clock, column) for column in averaged.T])
    v = np.column_stack([np.interp(samples, clock, column) for column in velocity.T])
    q[0], q[-1], v[0], v[-1] = positions[0], positions[-1], 0.0, 0.0
    return Trajectory(joint_names, samples, q, v)
