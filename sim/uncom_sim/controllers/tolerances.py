# SPDX-License-Identifier: Apache-2.0
"""Position and velocity tolerances of a trajectory goal, along the path and at its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from uncom_common.transforms import FloatArray

NO_LIMIT = np.inf


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Of one joint, as asked for in a goal: 0 means the controller's default, a negative number no limit."""

    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class GoalTolerances:
    """What a goal asks for, by joint name; `goal_time_s` of 0 means the default, a negative number no limit."""

    path: Mapping[str, Tolerance] = field(default_factory=dict)
    goal: Mapping[str, Tolerance] = field(default_factory=dict)
    goal_time_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits in force, each (joints,); infinity where there is none."""

    path_position: FloatArray
    path_velocity: FloatArray
    goal_position: FloatArray
    goal_velocity: FloatArray
    goal_time_s: float

    def path_error(self, position_error: FloatArray, velocity_error: FloatArray) -> int | None:
        """Return the index of a joint that has left its path, if any."""
        return _first_violation(
            np.abs(position_error) > self.path_position, np.abs(velocity_error) > self.path_velocity
        )

    def goal_error(self, position_error: FloatArray, velocity: FloatArray) -> int | None:
        """Return the index of a joint that is not at its goal, if any."""
        return _first_violation(np.abs(position_error) > self.goal_position, np.abs(velocity) > self.goal_velocity)


def _first_violation(*violations: npt.NDArray[np.bool_]) -> int | None:
    indices = np.flatnonzero(np.logical_or.reduce(violations))
    return int(indices[0]) if indices.size else None


def _requested(value: float, default: float) -> float:
    if value == 0.0:
        return default
    return value if value > 0.0 else NO_LIMIT


def limits(
    joints: Sequence[str],
    requested: GoalTolerances,
    goal_position: float,
    stopped_velocity: float,
    goal_time_s: float,
) -> Limits:
    """Combine what a goal asks for with a controller's defaults (positions [rad or m], velocities [/s], time [s])."""
    path = [requested.path.get(joint, Tolerance()) for joint in joints]
    goal = [requested.goal.get(joint, Tolerance()) for joint in joints]
    return Limits(
        path_position=np.array([_requested(t.position, NO_LIMIT) for t in path]),
        path_velocity=np.array([_requested(t.velocity, NO_LIMIT) for t in path]),
        goal_position=np.array([_requested(t.position, goal_position) for t in goal]),
        goal_velocity=np.array([_requested(t.velocity, stopped_velocity) for t in goal]),
        goal_time_s=_requested(requested.goal_time_s, goal_time_s),
    )
