# SPDX-License-Identifier: Apache-2.0
"""Time-optimal, jerk-limited motions along a straight line in joint space, from rest to rest.

They are computed by Ruckig (Berscheid and Kroeger 2021). It moves one coordinate, the share of the line that is done,
so that the motion stays on the line that was checked for collisions; Ruckig's own phase synchronisation of several
joints does not do so where their limits differ. Only start and end are given: with intermediate positions the
community edition of Ruckig calls a service on the network.
"""

from __future__ import annotations

import numpy as np
import ruckig

from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.trajectory.options import TIMING, TimingOptions
from uncom_tiago_exec.types import FloatArray


def is_straight(waypoints: FloatArray, *, options: TimingOptions = TIMING) -> bool:
    """Tell whether waypoints (N, J) lie on one line in their order, and the first and last differ."""
    tolerance = options.straight_tolerance
    difference = waypoints[-1] - waypoints[0]
    length = float(np.linalg.norm(difference))
    if length < tolerance:
        return False
    along = (waypoints - waypoints[0]) @ difference / length
    residual = waypoints - waypoints[0] - along[:, None] * difference / length
    return bool(np.abs(residual).max() < tolerance and (np.diff(along) > -tolerance).all())


def time_straight(
    start: FloatArray,
    end: FloatArray,
    limits: tuple[FloatArray, FloatArray, FloatArray],
    rate_hz: float,
    *,
    options: TimingOptions = TIMING,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the fastest motion along the straight line between two configurations.

    Args:
        start: joint positions (J,), at rest.
        end: joint positions (J,), at rest.
        limits: of velocity, acceleration and jerk, each (J,).
        rate_hz: of the samples.
        options: numbers that tune it.

    Returns:
        Times (T,) [s], positions (T, J) and velocities (T, J).

    Raises:
        PlanningError: Ruckig refuses the limits.
    """
    difference = end - start
    distances = np.abs(difference)
    velocity, acceleration, jerk = (float(np.min(limit / np.maximum(distances, 1e-12))) for limit in limits)
    request = ruckig.InputParameter(1)
    request.current_position, request.target_position = [0.0], [1.0]
    request.max_velocity, request.max_acceleration, request.max_jerk = [velocity], [acceleration], [jerk]
    motion = ruckig.Trajectory(1)
    try:
        ruckig.Ruckig(1).calculate(request, motion)
    except ruckig.RuckigError as err:
        raise PlanningError("a straight motion cannot be timed; check the limits of the joints") from err
    samples = np.append(
        np.arange(0.0, motion.duration - options.last_interval / rate_hz, 1.0 / rate_hz), motion.duration
    )
    states = [motion.at_time(float(t)) for t in samples]
    share, rate = np.array([s[0][0] for s in states]), np.array([s[1][0] for s in states])
    return samples, start + share[:, None] * difference, rate[:, None] * difference


def shortest_time(start: FloatArray, end: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray]) -> float:
    """Return the least time [s] of any motion from rest at `start` to rest at `end`, both (J,).

    The joints move independently, under limits of velocity, acceleration and jerk, each (J,): a lower bound for motions
    along any path.
    """
    velocity, acceleration, jerk = limits
    count = len(start)
    request = ruckig.InputParameter(count)
    request.current_position, request.target_position = start.tolist(), end.tolist()
    request.max_velocity, request.max_acceleration, request.max_jerk = (
        velocity.tolist(),
        acceleration.tolist(),
        jerk.tolist(),
    )
    motion = ruckig.Trajectory(count)
    ruckig.Ruckig(count).calculate(request, motion)
    return float(motion.duration)
