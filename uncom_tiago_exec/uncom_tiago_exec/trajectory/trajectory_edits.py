# SPDX-License-Identifier: Apache-2.0
"""Changes of a planned motion: its reversal, and a start that differs slightly from the planned one."""

from __future__ import annotations

from dataclasses import replace

from uncom_tiago_exec.types import FloatArray, Trajectory


def reversed_trajectory(trajectory: Trajectory) -> Trajectory:
    """Return the same motion in reverse: it begins where the other ends, at the same speeds."""
    times = trajectory.times[-1] - trajectory.times[::-1]
    return Trajectory(trajectory.joint_names, times, trajectory.positions[::-1], -trajectory.velocities[::-1])


def started_at(trajectory: Trajectory, here: FloatArray) -> Trajectory:
    """Return a motion that begins at joint positions (J,) near the planned start and ends as planned.

    The difference at the start fades out along the minimum-jerk polynomial of the time share,
    10 t^3 - 15 t^4 + 6 t^5 (Flash and Hogan 1985), with zero velocity and acceleration at both ends.
    """
    share = trajectory.times / trajectory.times[-1]
    remaining = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    remaining_rate = -30.0 * share**2 * (1.0 - share) ** 2 / trajectory.times[-1]
    difference = here - trajectory.positions[0]
    return replace(
        trajectory,
        positions=trajectory.positions + remaining[:, None] * difference,
        velocities=trajectory.velocities + remaining_rate[:, None] * difference,
    )
