# SPDX-License-Identifier: Apache-2.0
"""Follows joint trajectories as ros2_controllers' joint_trajectory_controller does, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from uncom_common.transforms import FloatArray

from uncom_sim.controllers.tolerances import GoalTolerances, Limits, limits
from uncom_sim.controllers.trajectory import ErrorCode, SetPoint, Trajectory, Waypoint, check, in_order, sample


@dataclass(frozen=True, slots=True)
class TrajectoryControllerConfig:
    """A controller's joints and default tolerances (facts of the robot's own configuration files)."""

    name: str
    joints: tuple[str, ...]
    goal_tolerance: float  # [rad or m]
    goal_time_s: float
    stopped_velocity: float = 5.0  # [/s]
    # A finger that is stopped by an object keeps pressing by this much when it is told to hold [m].
    hold_margin: float = 0.0


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a goal ended."""

    code: ErrorCode
    text: str
    cancelled: bool = False


Done = Callable[[Outcome], None]


class TrajectoryController:
    """One controller; all calls come from the thread that steps the simulation."""

    def __init__(self, config: TrajectoryControllerConfig, position: FloatArray) -> None:
        """Follow no trajectory; the set-point is a position (joints,) [rad or m] in the order of config.joints."""
        self.config = config
        zero = np.zeros(len(config.joints))
        self.desired = SetPoint(np.array(position, dtype=float), zero, zero)
        self._points: tuple[Waypoint, ...] = ()
        self._limits: Limits | None = None
        self._done: Done | None = None

    @property
    def active(self) -> bool:
        """Whether an action goal is being followed."""
        return self._done is not None

    def start(
        self, trajectory: Trajectory, now_s: float, tolerances: GoalTolerances | None = None, done: Done | None = None
    ) -> None:
        """Follow a trajectory from now on (or from its start time); a goal that was active is aborted.

        The way from the present set-point to the first way-point takes all the time there is until then.
        `done` is called once with the outcome of an action goal; without it (a message on the topic) nobody is told.

        Raises:
            TrajectoryError: the trajectory cannot be followed; what was active goes on.
        """
        config = self.config
        check(trajectory, config.joints, now_s)
        ordered = in_order(trajectory, config.joints)
        self._finish(Outcome(ErrorCode.INVALID_GOAL, "Current goal cancelled due to new incoming action."))
        start = trajectory.start_s if trajectory.start_s > 0.0 else now_s
        here = Waypoint(now_s, self.desired.positions, self.desired.velocities, self.desired.accelerations)
        ahead = [Waypoint(start + p.time_s, p.positions, p.velocities, p.accelerations) for p in ordered.points]
        self._points = (here, *(p for p in ahead if p.time_s > now_s)) if ahead[-1].time_s > now_s else (ahead[-1],)
        self._limits = limits(
            config.joints,
            tolerances or GoalTolerances(),
            config.goal_tolerance,
            config.stopped_velocity,
            config.goal_time_s,
        )
        self._done = done

    def update(self, now_s: float, position: FloatArray, velocity: FloatArray) -> SetPoint:
        """Return the set-point for now, given the joints' state, and end the goal when it is reached or missed.

        The same object is returned as long as nothing changes.
        """
        if not self._points:
            return self.desired
        self.desired = sample(self._points, now_s)
        if self._done is None and now_s >= self._points[-1].time_s:
            self._points = ()
        elif self._done is not None and self._limits is not None:
            error = self.desired.positions - position
            if now_s < self._points[-1].time_s:
                self._check_path(self._limits, error, self.desired.velocities - velocity, position)
            else:
                self._check_goal(self._limits, now_s - self._points[-1].time_s, error, velocity, position)
        return self.desired

    def cancel(self, position: FloatArray) -> None:
        """End the goal and hold the joints where they are."""
        self.hold(position)
        self._finish(Outcome(ErrorCode.SUCCESSFUL, "Goal cancelled", cancelled=True))

    def hold(self, position: FloatArray) -> None:
        """Stay at a position (joints,); fingers that press on something keep pressing."""
        margin = self.config.hold_margin
        zero = np.zeros_like(position)
        pressed = np.clip(self.desired.positions - position, -margin, margin)
        self.desired = SetPoint(position + pressed, zero, zero)
        self._points = ()

    def _check_path(
        self, in_force: Limits, error: FloatArray, velocity_error: FloatArray, position: FloatArray
    ) -> None:
        joint = in_force.path_error(error, velocity_error)
        if joint is None:
            return
        name = self.config.joints[joint]
        self.hold(position)
        text = f"Aborted due to path tolerance violation: {name} is {abs(error[joint]):.4f} off"
        self._finish(Outcome(ErrorCode.PATH_TOLERANCE_VIOLATED, text))

    def _check_goal(
        self, in_force: Limits, late_s: float, error: FloatArray, velocity: FloatArray, position: FloatArray
    ) -> None:
        joint = in_force.goal_error(error, velocity)
        if joint is None:
            self._finish(Outcome(ErrorCode.SUCCESSFUL, "Goal successfully reached!"))
        elif late_s > in_force.goal_time_s:
            name = self.config.joints[joint]
            self.hold(position)
            text = f"Aborted due to goal_time_tolerance exceeding by {late_s - in_force.goal_time_s:.3f} seconds: "
            text += f"{name} is {abs(error[joint]):.4f} off"
            self._finish(Outcome(ErrorCode.GOAL_TOLERANCE_VIOLATED, text))

    def _finish(self, outcome: Outcome) -> None:
        done, self._done = self._done, None
        if done is not None:
            done(outcome)
