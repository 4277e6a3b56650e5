# SPDX-License-Identifier: Apache-2.0
"""A planned motion backwards, or from a start a little beside its own."""

from __future__ import annotations

from dataclasses import replace

from uncom_tiago_exec.types import FloatArray, Trajectory


def reversed_trajectory(trajectory: Trajectory) -> Trajectory:
    """Return the same motion backwards."""
    times = trajectory.times[-1] - trajectory.times[::-1]
    return Trajectory(trajectory.joint_names, times, trajectory.positions[::-1], -trajectory.velocities[::-1])


def started_at(trajectory: Trajectory, here: FloatArray) -> Trajectory:
    """Return a motion that begins at joint positions (J,) near its own start, and ends as it did."""
    share = trajectory.times / trajectory.times[-1]
    left = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    pace = -30.0 * share**2 * (1.0 - share) ** 2 / trajectory.times[-1]
    away = here - trajectory.positions[0]
    return replace(
        trajectory,
        positions=trajectory.positions + left[:, None] * away,
        velocities=trajectory.velocities + pace[:, None] * away,
    )
