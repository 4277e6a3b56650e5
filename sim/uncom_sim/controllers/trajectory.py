# SPDX-License-Identifier: Apache-2.0
"""Joint trajectories: the goals that are accepted, and the interpolated set-point at a time.

The rules are those of ros2_controllers' joint_trajectory_controller (Jazzy): what is refused, which spline is used,
what tolerances of -1 and 0 mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from uncom_common.transforms import FloatArray

from uncom_sim.exceptions import SimError
from uncom_sim.types import NEGLIGIBLE


class ErrorCode(IntEnum):
    """Result codes of control_msgs/action/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class TrajectoryError(SimError, ValueError):
    """A trajectory that the controller cannot take."""

    def __init__(self, code: ErrorCode, why: str) -> None:
        """Code is the result code of FollowJointTrajectory that says what is wrong; why is the text for the client."""
        self.code = code
        super().__init__(why)


@dataclass(frozen=True, slots=True)
class Waypoint:
    """Joint positions [rad or m] with optional velocities [/s] and accelerations [/s^2], each (joints,)."""

    time_s: float
    positions: FloatArray
    velocities: FloatArray | None = None
    accelerations: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Way-points of named joints; times count from `start_s` (ROS time), or from now when that is 0."""

    joints: tuple[str, ...]
    points: tuple[Waypoint, ...]
    start_s: float = 0.0


@dataclass(frozen=True, slots=True)
class SetPoint:
    """Where the joints should be, how fast [/s] and how they accelerate [/s^2], each (joints,)."""

    positions: FloatArray
    velocities: FloatArray
    accelerations: FloatArray


def check(trajectory: Trajectory, joints: Sequence[str], now_s: float) -> None:
    """Refuse what joint_trajectory_controller refuses.

    Raises:
        TrajectoryError: joints missing, unknown or double; way-points missing, out of order or of the wrong size;
            a trajectory that ends in the past or does not stop at its end.
    """
    names = trajectory.joints
    if len(set(names)) != len(names) or set(names) != set(joints):
        raise TrajectoryError(ErrorCode.INVALID_JOINTS, f"name each of these joints once: {', '.join(joints)}")
    if not trajectory.points:
        raise TrajectoryError(ErrorCode.INVALID_GOAL, "the trajectory has no points")
    before = -np.inf
    for i, point in enumerate(trajectory.points):
        _check_point(i, point, len(names))
        if point.time_s <= before or point.time_s < 0.0:
            raise TrajectoryError(
                ErrorCode.INVALID_GOAL, f"time_from_start of point {i} must come after the one before"
            )
        before = point.time_s
    if trajectory.start_s > 0.0 and trajectory.start_s + before < now_s:
        raise TrajectoryError(ErrorCode.OLD_HEADER_TIMESTAMP, "the trajectory ends in the past; check header.stamp")
    final = trajectory.points[-1].velocities
    if final is not None and np.any(np.abs(final) > NEGLIGIBLE):
        raise TrajectoryError(ErrorCode.INVALID_GOAL, "the velocities of the last point must be zero")


def _check_point(index: int, point: Waypoint, count: int) -> None:
    named = {"positions": point.positions, "velocities": point.velocities, "accelerations": point.accelerations}
    for name, values in named.items():
        if values is None:
            continue
        if len(values) != count:
            text = f"point {index} has {len(values)} {name} for {count} joints"
            raise TrajectoryError(ErrorCode.INVALID_GOAL, text)
        if not np.all(np.isfinite(values)):
            raise TrajectoryError(ErrorCode.INVALID_GOAL, f"point {index} has {name} that are not finite")


def in_order(trajectory: Trajectory, joints: Sequence[str]) -> Trajectory:
    """Return the same trajectory with its joints in a given order."""
    order = [trajectory.joints.index(name) for name in joints]

    def pick(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else np.asarray(values, dtype=float)[order]

    points = tuple(
        Waypoint(p.time_s, np.asarray(p.positions, dtype=float)[order], pick(p.velocities), pick(p.accelerations))
        for p in trajectory.points
    )
    return Trajectory(tuple(joints), points, trajectory.start_s)


def sample(points: Sequence[Waypoint], time_s: float) -> SetPoint:
    """Return the set-point at a time; before the first and after the last way-point it stays there.

    Two way-points with velocities are joined by a cubic, with accelerations too by a quintic, else by a line.
    """
    zero = np.zeros_like(points[0].positions)
    if time_s <= points[0].time_s:
        return SetPoint(points[0].positions, zero, zero)
    if time_s >= points[-1].time_s:
        return SetPoint(points[-1].positions, zero, zero)
    after = next(i for i, point in enumerate(points) if point.time_s > time_s)
    return _between(points[after - 1], points[after], time_s - points[after - 1].time_s)


def _between(a: Waypoint, b: Waypoint, t: float) -> SetPoint:
    """Interpolate a segment at t seconds after its start."""
    d = b.time_s - a.time_s
    span = b.positions - a.positions
    zero = np.zeros_like(span)
    if a.velocities is None or b.velocities is None:
        return SetPoint(a.positions + span * (t / d), span / d, zero)
    v0, v1 = a.velocities, b.velocities
    if a.accelerations is None or b.accelerations is None:
        terms = [a.positions, v0, (3 * span / d - 2 * v0 - v1) / d, (-2 * span / d + v0 + v1) / d**2]
    else:
        a0, a1 = a.accelerations, b.accelerations
        terms = [
            a.positions,
            v0,
            a0 / 2,
            (20 * span - (8 * v1 + 12 * v0) * d - (3 * a0 - a1) * d**2) / (2 * d**3),
            (-30 * span + (14 * v1 + 16 * v0) * d + (3 * a0 - 2 * a1) * d**2) / (2 * d**4),
            (12 * span - 6 * (v1 + v0) * d + (a1 - a0) * d**2) / (2 * d**5),
        ]
    position, velocity, acceleration = zero.copy(), zero.copy(), zero.copy()
    for power, term in enumerate(terms):
        position = position + term * t**power
        if power >= 1:
            velocity = velocity + power * term * t ** (power - 1)
        if power > 1:
            acceleration = acceleration + power * (power - 1) * term * t ** (power - 2)
    return SetPoint(position, velocity, acceleration)
