# SPDX-License-Identifier: Apache-2.0
"""The fingers: closing on an object, telling from their gap whether it is held, and letting it go."""

from __future__ import annotations

import logging

from uncom_tiago_exec.exceptions import GraspFailedError, MotionError
from uncom_tiago_exec.execution.options import GRIP, GripOptions
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.planning.plan import GripStep, Plan
from uncom_tiago_exec.robot.gripper_joints import finger_gap

_LOG = logging.getLogger(__name__)


class GripController:
    """Moves the fingers of the arm of a plan; `pending` is what they were told and have not come to."""

    def __init__(self, robot: RobotInterface, options: GripOptions = GRIP) -> None:
        """Take the access to the robot; nothing moves yet."""
        self._robot = robot
        self._options = options
        self._held_gap = 0.0
        self.pending: GripStep | None = None

    def move(self, plan: Plan, step: GripStep) -> None:
        """Bring the fingers to the gap of a step."""
        self.pending = step
        self._robot.grip(plan.side, step.gap)
        self.pending = None

    def close(self, plan: Plan, step: GripStep, name: str) -> float:
        """Close on an object, press, and return the gap [m]; the step stays pending until `settle`.

        Raises:
            GraspFailedError: nothing is between the fingers.
        """
        self.pending = step
        width = _width(plan)
        gap = self._robot.grip(plan.side, self._pressing_gap(width))
        gap = self._robot.grip(plan.side, self._pressing_gap(gap))
        if gap < self._empty_gap(width):
            raise GraspFailedError(f"my fingers closed beside the {name}")
        self._held_gap = gap
        return gap

    def settle(self) -> None:
        """Take it that the fingers have come to where they were told to."""
        self.pending = None

    def press(self, plan: Plan) -> None:
        """Close a finger that was held up by the table, not by the object."""
        self._robot.grip(plan.side, self._pressing_gap(self._held_gap))

    def open(self, plan: Plan) -> None:
        """Open the fingers as wide as the grasp of a plan needs."""
        if plan.grasp is not None:
            self._robot.grip(plan.side, plan.grasp.opening)

    def release(self, plan: Plan, step: GripStep) -> None:
        """Open the fingers, again and again if something holds them: a pad may be wedged in a narrow opening.

        Raises:
            MotionError: they stay closed; what they hold would be torn away.
        """
        options = self._options
        self.pending = step
        for attempt in range(options.release_retries + 1):
            gap = self._robot.grip(plan.side, step.gap)
            if gap > step.gap - options.stuck_m:
                self.pending = None
                return
            if attempt < options.release_retries:
                self._robot.grip(plan.side, self._pressing_gap(gap))
        if gap < self._held_gap + options.freed_m:
            raise MotionError("my fingers do not open")
        _LOG.warning("something beside it keeps the fingers from opening wider than %.0f mm", 1000.0 * gap)
        self.pending = None

    def holds_nothing(self, plan: Plan) -> bool:
        """Tell from the gap of the fingers whether what was held is gone."""
        least = max(self._empty_gap(_width(plan)), self._held_gap - self._options.slipped_m)
        return finger_gap(plan.side, self._robot.positions()) < least

    def _pressing_gap(self, gap: float) -> float:
        """Return the gap [m] to aim at with something `gap` wide between the fingers."""
        return max(0.0, gap - self._options.squeeze_m)

    def _empty_gap(self, width: float) -> float:
        """Return the gap [m] under which fingers that closed on something `width` wide hold nothing."""
        return max(self._options.empty_gap_m, self._options.empty_width_ratio * width)


def _width(plan: Plan) -> float:
    return plan.grasp.width if plan.grasp is not None else 0.0
