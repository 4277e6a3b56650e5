# SPDX-License-Identifier: Apache-2.0
"""Driving the base nearer to the table and back to where it began."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from uncom_tiago_exec.exceptions import ExecutionError, StoppedError
from uncom_tiago_exec.execution.base_velocity import DRIVE_TOLERANCE
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.types import BasePose

_MOVED_BY_OTHERS = 0.05  # [m] what stands farther from where it began was moved by others: it begins anew


class BaseDriver:
    """Knows where the base began (`home`), and whether it was driven from there and not back yet (`is_away`)."""

    def __init__(self, robot: RobotInterface) -> None:
        """Take the robot whose base is driven; nothing moves yet."""
        self._robot = robot
        self._home: BasePose | None = None
        self.is_away = False

    @property
    def pose(self) -> BasePose:
        """Where the base stands now."""
        return self._robot.base_pose()

    @contextmanager
    def driven(self, distance: float, is_home: Callable[[], bool]) -> Iterator[None]:
        """Drive nearer by a distance [m], and back at the end.

        After a stop, or a fault that left an arm elsewhere than at home, it stays: the next command brings both back.
        """
        self._drive_on(distance)
        try:
            yield
        except ExecutionError as error:
            if not isinstance(error, StoppedError) and is_home():
                self.back()
            raise
        self.back()

    def _drive_on(self, distance: float) -> None:
        here = self.pose
        if not self.is_away and (self._home is None or _distance(self._home, here) > _MOVED_BY_OTHERS):
            self._home = here
        home = self._home or here
        try:
            self._robot.drive(distance)
        finally:
            self.is_away = _distance(home, self.pose) > DRIVE_TOLERANCE

    def back(self) -> None:
        """Drive back to where it began; by how much it stops short is made good the next time, and never adds up."""
        if self._home is not None and self.is_away:
            self._robot.drive(self.pose.distance_ahead(self._home))
            self.is_away = False


def _distance(a: BasePose, b: BasePose) -> float:
    return float(np.hypot(a.x - b.x, a.y - b.y))
