# SPDX-License-Identifier: Apache-2.0
"""Driving the base nearer to the table and back, and knowing how far it is ahead of where it began."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from uncom_tiago_exec.exceptions import ExecutionError, StoppedError
from uncom_tiago_exec.execution.robot_interface import RobotInterface


class BaseDriver:
    """`ahead` is how far the base has been driven on [m]; a stop on the way counts as far as it had come."""

    def __init__(self, robot: RobotInterface) -> None:
        """Keep the robot; nothing moves yet."""
        self._robot = robot
        self.ahead = 0.0
        self._off = 0.0  # [m] how far it stopped from where it began when it was driven back last

    @contextmanager
    def driven(self, ahead: float, is_home: Callable[[], bool]) -> Iterator[None]:
        """Drive nearer by a distance [m], and back at the end.

        After a stop, or a fault that left an arm elsewhere than at home, it stays: the next command brings both back.
        """
        self._drive(ahead)
        try:
            yield
        except ExecutionError as error:
            if not isinstance(error, StoppedError) and is_home():
                self.back()
            raise
        self.back()

    def back(self) -> None:
        """Drive back to where it began; by how much it stops short is made good the next time, and never adds up."""
        if self.ahead != 0.0:
            self._drive(-self.ahead - self._off)
            self._off += self.ahead
            self.ahead = 0.0

    def _drive(self, distance: float) -> None:
        try:
            self.ahead += self._robot.drive(distance)
        except StoppedError as error:
            self.ahead += error.driven_m
            raise
