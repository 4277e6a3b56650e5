# SPDX-License-Identifier: Apache-2.0
"""Times a straight line in joint space, from rest to rest, as fast as its limits allow (Ruckig).

Ruckig moves one number, the share of the line that is done, so the motion stays on the line that was checked for
collisions (its own phase synchronisation of several joints gives way where limits differ). Only start and end are
given: intermediate positions would make Ruckig's community edition call a service on the network.
"""

from __future__ import annotations

import numpy as np
import ruckig

from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.types import FloatArray


def is_straight(waypoints: FloatArray, tolerance: float = 1e-6) -> bool:
    """Tell whether waypoints (N, J) lie on one line, in order, and lead somewhere."""
    whole = waypoints[-1] - waypoints[0]
    length = float(np.linalg.norm(whole))
    if length < tolerance:
        return False
    along = (waypoints - waypoints[0]) @ whole / length
    beside = waypoints - waypoints[0] - along[:, None] * whole / length
    return bool(np.abs(beside).max() < tolerance and (np.diff(along) > -tolerance).all())


def time_straight(
    start: FloatArray, end: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray], rate_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (T,), positions and velocities (T, J) of the fastest motion from start to end, both (J,).

    The limits are velocity, acceleration and jerk, each (J,).

    Raises:
        PlanningError: Ruckig refuses the limits.
    """
    way = end - start
    share = np.abs(way)
    velocity, acceleration, jerk = (float(np.min(limit / np.maximum(share, 1e-12))) for limit in limits)
    goal = ruckig.InputParameter(1)
    goal.current_position, goal.target_position = [0.0], [1.0]
    goal.max_velocity, goal.max_acceleration, goal.max_jerk = [velocity], [acceleration], [jerk]
    motion = ruckig.Trajectory(1)
    try:
        ruckig.Ruckig(1).calculate(goal, motion)
    except ruckig.RuckigError as err:
        raise PlanningError("a straight motion cannot be timed; check the limits of the joints") from err
    samples = np.append(np.arange(0.0, motion.duration - 0.25 / rate_hz, 1.0 / rate_hz), motion.duration)
    states = [motion.at_time(float(t)) for t in samples]
    done, pace = np.array([s[0][0] for s in states]), np.array([s[1][0] for s in states])
    return samples, start + done[:, None] * way, pace[:, None] * way


def shortest_time(start: FloatArray, end: FloatArray, limits: tuple[FloatArray, FloatArray, FloatArray]) -> float:
    """Return the least time [s] from rest at start to rest at end, both (J,), whatever way between the joints take.

    The limits are velocity, acceleration and jerk, each (J,); this is the bound that no motion can beat.
    """
    velocity, acceleration, jerk = limits
    count = len(start)
    goal = ruckig.InputParameter(count)
    goal.current_position, goal.target_position = start.tolist(), end.tolist()
    goal.max_velocity, goal.max_acceleration, goal.max_jerk = velocity.tolist(), acceleration.tolist(), jerk.tolist()
    motion = ruckig.Trajectory(count)
    ruckig.Ruckig(count).calculate(goal, motion)
    return float(motion.duration)
