# SPDX-License-Identifier: Apache-2.0
"""What the engine needs from a robot, be it real, simulated behind ROS, or simulated in one process."""

from __future__ import annotations

from abc import ABC, abstractmethod

from uncom_perception.types import Scene

from uncom_tiago_exec.exceptions import MotionError
from uncom_tiago_exec.types import ODOM_ORIGIN, BasePose, Side, Trajectory


class RobotInterface(ABC):
    """Blocking access from the engine's own thread. Every call may raise StoppedError once `halt` was asked for."""

    @abstractmethod
    def positions(self) -> dict[str, float]:
        """Return the present position of every joint [rad, m].

        Raises:
            MotionError: joint states are missing or too old.
        """

    def base_pose(self) -> BasePose:
        """Return where the base stands now, by its odometry; a base that does not drive stays at the origin of odom."""
        return ODOM_ORIGIN

    @abstractmethod
    def follow(self, trajectory: Trajectory) -> None:
        """Carry out a trajectory to its end.

        Raises:
            MotionError: a controller refused or aborted it, or joint states fell silent.
            StoppedError: it was stopped on request.
        """

    @abstractmethod
    def grip(self, side: Side, gap: float) -> float:
        """Bring the fingers of a gripper to a gap [m]; return the gap they came to. Being held up is no error."""

    @abstractmethod
    def look(self) -> Scene:
        """Look at the table now and return what is seen, in base_footprint where the base stands.

        Raises:
            MotionError: no picture came or nothing could be made of it.
        """

    def drive(self, distance: float) -> None:
        """Drive the base straight on by a distance [m], back if negative; `base_pose` tells how far it went.

        Raises:
            MotionError: this robot's base cannot be driven, or it did not get there.
            StoppedError: it was stopped on request.
        """
        raise MotionError(f"the base cannot be driven ({distance:.2f} m)")
