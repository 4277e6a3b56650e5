# SPDX-License-Identifier: Apache-2.0
"""Driving the base nearer to the table and back to where it began."""

from __future__ import annotations

import numpy as np

from uncom_tiago_exec.execution.options import BASE_DRIVE, BaseDriveOptions
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.types import BasePose


class BaseDriver:
    """Drives the base, and knows where it began and whether it is away from there."""

    def __init__(self, robot: RobotInterface, options: BaseDriveOptions = BASE_DRIVE) -> None:
        """Take the robot whose base is driven; nothing moves yet."""
        self._robot = robot
        self._options = options
        self._home: BasePose | None = None
        self.is_away = False

    @property
    def pose(self) -> BasePose:
        """Where the base stands now."""
        return self._robot.base_pose()

    def drive_nearer(self, distance: float) -> None:
        """Drive straight on by a distance [m]; `back` brings the base back from wherever that ended.

        Raises:
            MotionError: the base cannot be driven, or did not get there.
            StoppedError: it was stopped on its way.
        """
        here = self.pose
        if not self.is_away and (self._home is None or _distance(self._home, here) > self._options.displaced_m):
            self._home = here
        home = self._home or here
        try:
            self._robot.drive(distance)
        finally:
            self.is_away = _distance(home, self.pose) > self._options.tolerance_m

    def drive_back(self) -> None:
        """Drive back to where the base began, if it is away; by how much it stops short never adds up.

        Raises:
            MotionError: the base did not get there.
            StoppedError: it was stopped on its way.
        """
        if self._home is not None and self.is_away:
            self._robot.drive(self.pose.distance_ahead(self._home))
            self.is_away = False


def drive_velocity(remaining: float, options: BaseDriveOptions = BASE_DRIVE) -> float:
    """Return the velocity [m/s] at which to drive the distance that remains [m]; 0 once it is small enough."""
    if abs(remaining) < options.tolerance_m:
        return 0.0
    speed = min(options.speed_mps, max(options.gain_per_s * abs(remaining), options.least_speed_mps))
    return float(np.copysign(speed, remaining))


def _distance(a: BasePose, b: BasePose) -> float:
    return float(np.hypot(a.x - b.x, a.y - b.y))
