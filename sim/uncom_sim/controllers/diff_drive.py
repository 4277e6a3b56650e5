# SPDX-License-Identifier: Apache-2.0
"""Base velocity with limits and time-out, and wheel odometry (as ros2_controllers' diff_drive_controller)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class DiffDriveConfig:
    """The robot's own numbers."""

    wheel_radius_m: float = 0.0985
    wheel_separation_m: float = 0.4044
    command_timeout_s: float = 0.25
    min_linear: float = -0.2  # [m/s]
    max_linear: float = 1.0  # [m/s]
    max_linear_acceleration: float = 1.0  # [m/s^2]
    max_angular: float = 2.09  # [rad/s]
    max_angular_acceleration: float = 2.09  # [rad/s^2]


@dataclass(frozen=True, slots=True)
class Odometry:
    """Pose since the start [m, rad], velocity [m/s, rad/s], and how far the wheels have turned (left, right) [rad]."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    linear: float = 0.0
    angular: float = 0.0
    wheels: tuple[float, float] = (0.0, 0.0)


class DiffDrive:
    """Limits commanded velocities and keeps the odometry."""

    def __init__(self, config: DiffDriveConfig | None = None) -> None:
        """Start at the origin of odom with velocity 0."""
        self.config = config or DiffDriveConfig()
        self.odometry = Odometry()
        self._command = (0.0, 0.0)
        self._commanded_s = -np.inf
        self._output = (0.0, 0.0)

    def command(self, linear: float, angular: float, now_s: float) -> None:
        """Take a velocity [m/s, rad/s]; it holds until the time-out. What is not finite is ignored."""
        if np.isfinite(linear) and np.isfinite(angular):
            self._command = (linear, angular)
            self._commanded_s = now_s

    def update(self, now_s: float, step_s: float) -> tuple[float, float]:
        """Return the velocity [m/s, rad/s] to drive with during the next step."""
        c = self.config
        linear, angular = self._command if now_s - self._commanded_s <= c.command_timeout_s else (0.0, 0.0)
        linear = min(max(linear, c.min_linear), c.max_linear)
        angular = min(max(angular, -c.max_angular), c.max_angular)
        self._output = (
            _approach(self._output[0], linear, c.max_linear_acceleration * step_s),
            _approach(self._output[1], angular, c.max_angular_acceleration * step_s),
        )
        return self._output

    def integrate(self, linear: float, angular: float, step_s: float) -> None:
        """Add what the wheels turned in one step, the base moving at a velocity [m/s, rad/s]."""
        o, c = self.odometry, self.config
        heading = o.yaw + 0.5 * angular * step_s
        spin = 0.5 * angular * c.wheel_separation_m
        turn = step_s / c.wheel_radius_m
        self.odometry = Odometry(
            o.x + linear * step_s * float(np.cos(heading)),
            o.y + linear * step_s * float(np.sin(heading)),
            float(np.arctan2(np.sin(o.yaw + angular * step_s), np.cos(o.yaw + angular * step_s))),
            linear,
            angular,
            (o.wheels[0] + (linear - spin) * turn, o.wheels[1] + (linear + spin) * turn),
        )


def _approach(value: float, goal: float, most: float) -> float:
    return value + min(max(goal - value, -most), most)
