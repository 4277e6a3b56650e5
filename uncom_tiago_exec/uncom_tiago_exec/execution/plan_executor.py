# SPDX-License-Identifier: Apache-2.0
"""Executes the steps of a plan and knows what is in the hand: take, carry, place, and the ways back."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import ExecutionError, GraspFailedError, MotionError, StoppedError
from uncom_tiago_exec.execution.grip_controller import GripController
from uncom_tiago_exec.execution.options import GRIP, PLAN_EXECUTION, GripOptions, PlanExecutionOptions
from uncom_tiago_exec.execution.recovery import InterruptedArm, plan_lift_clear, plan_way_home
from uncom_tiago_exec.execution.robot_interface import RobotInterface
from uncom_tiago_exec.planning.plan import GripStep, MoveStep, Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.trajectory.trajectory_edits import reversed_trajectory, started_at
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage, Status, Trajectory

_LOG = logging.getLogger(__name__)
StatusCallback = Callable[[Status], None]  # takes every change of stage


class PlanExecutor:
    """Executes steps one after the other; `stage` is the last one told, `in_hand` the label of what is held."""

    def __init__(
        self,
        model: RobotModel,
        robot: RobotInterface,
        config: ExecutionConfig,
        on_status: StatusCallback,
        options: PlanExecutionOptions = PLAN_EXECUTION,
        grip: GripOptions = GRIP,
    ) -> None:
        """Take the robot and its model; nothing moves yet.

        Args:
            model: of the robot.
            robot: the access to it.
            config: of the node: limits of motions.
            on_status: called with every change of stage.
            options: what a motion may differ from its plan by.
            grip: how fingers hold, and what their gap tells.
        """
        self.model = model
        self._robot = robot
        self._config = config
        self._on_status = on_status
        self._options = options
        self._grip = GripController(robot, grip)
        self.stage = Stage.IDLE
        self.in_hand = ""
        self._last_motion: Trajectory | None = None  # of torso and arm, be it to its end or not
        self._last_motion_stage = Stage.IDLE
        self._released = False  # the object of the present plan was let go at its place

    def follow(self, trajectory: Trajectory) -> None:
        """Carry out a motion, and remember it.

        Raises:
            MotionError: it ended elsewhere, or would begin elsewhere than where the arm is: nothing has moved then.
        """
        away = float(np.abs(self._positions_of(trajectory) - trajectory.positions[0]).max())
        if away > self._options.start_deviation:
            raise MotionError(f"the next motion begins {away:.2f} rad from where the arm is")
        self._last_motion, self._last_motion_stage = trajectory, self.stage
        self._robot.follow(trajectory)

    def report(self, stage: Stage, detail: str = "", arm: str = "", data: dict[str, object] | None = None) -> None:
        """Report a change of stage, with details, the side of the arm, and data for JSON."""
        self._on_status(Status(stage, detail, arm, data or {}))
        self.stage = stage

    def holds_nothing(self, plan: Plan) -> bool:
        """Tell from the gap of the fingers whether what was held is gone."""
        return self._grip.holds_nothing(plan)

    def take(self, task: ManipulationTask, plan: Plan) -> None:
        """Go to the object, close the fingers on it and lift it, or whatever comes first in the plan.

        Raises:
            GraspFailedError: nothing is between the fingers.
        """
        name = task.object_text or task.object.label or "object"
        holding = self._released = False
        for step in plan.steps:
            if step.stage > Stage.LIFTING:
                break
            self._announce(step, plan)
            if isinstance(step, MoveStep):
                self.follow(step.trajectory)
            elif step.holding:
                self._close(plan, step, name)
                holding = True
            else:
                self._grip.move(plan, step)
            if holding and step.stage == Stage.LIFTING:
                self._grip.press(plan)
                self._require_held(plan, name, "the {} slipped out of my fingers")

    def _close(self, plan: Plan, step: GripStep, name: str) -> None:
        """Close on the object, and tell from the gap whether anything is there."""
        gap = self._grip.close(plan, step, name)
        self.report(Stage.GRASPING, f"holding something {gap * 1000:.0f} mm wide", plan.side, {"gap_m": round(gap, 4)})
        self._grip.settle()
        self.in_hand = name

    def _require_held(self, plan: Plan, name: str, lost: str) -> None:
        """See from the gap of the fingers that an object is still held.

        Raises:
            GraspFailedError: it is not; the text is `lost` with its name.
        """
        if self.holds_nothing(plan):
            self.in_hand = ""
            raise GraspFailedError(lost.format(name))

    def _announce(self, step: MoveStep | GripStep, plan: Plan) -> None:
        data: dict[str, object] = {}
        if isinstance(step, MoveStep):
            data["duration_s"] = round(step.trajectory.duration_s, 3)
        self.report(step.stage, step.detail, plan.side, data)

    def carry(self, plan: Plan) -> None:
        """Bring the object over its place.

        Raises:
            GraspFailedError: it was lost on the way, which is noticed there.
        """
        for step in plan.steps:
            if isinstance(step, MoveStep) and step.stage == Stage.TRANSFERRING:
                self._announce(step, plan)
                self.follow(step.trajectory)
                if plan.grasp is not None:
                    self._require_held(plan, self.in_hand, "I lost the {} on the way")

    def place(self, plan: Plan) -> None:
        """Set the object down, let go, and go home.

        On the last centimetres it may touch what it is to rest on, and turn or move between the fingers as it settles:
        the fingers then close further and tell nothing. Whether it stands where it should is seen afterwards.
        """
        resting = False
        for step in plan.steps:
            if step.stage <= Stage.TRANSFERRING:
                continue
            if isinstance(step, MoveStep):
                self._announce(step, plan)
                if step.stage == Stage.PLACING:
                    resting = not self._lower(step, plan)
                elif resting and step.stage == Stage.RETREATING:
                    self.follow(started_at(step.trajectory, self._positions_of(step.trajectory)))
                else:
                    self.follow(step.trajectory)
            elif step.stage == Stage.PLACING:
                self._announce(step, plan)
                self._grip.release(plan, step)
                self.in_hand, self._released = "", True
            else:
                self._grip.move(plan, step)

    def _lower(self, step: MoveStep, plan: Plan) -> bool:
        """Lower the object; return False if it rests on something a little before the end.

        Raises:
            MotionError: the motion ended elsewhere.
        """
        try:
            self.follow(step.trajectory)
        except MotionError:
            group = self.model.group(plan.side, self._robot.positions())
            here = group.forward(self._positions_of(step.trajectory))
            there = group.forward(step.trajectory.positions[-1])
            if float(np.linalg.norm((here - there)[:3, 3])) > self._early_contact(plan):
                raise
            return False
        return True

    def _positions_of(self, trajectory: Trajectory) -> FloatArray:
        positions = self._robot.positions()
        return np.array([positions[name] for name in trajectory.joint_names])

    def recover(self, plan: Plan, why: str = "something went wrong; I go back to where I began") -> bool:
        """Go home after a fault without dropping what is held, if there is a free way; else stay and return False."""
        forward_first = self._last_motion_stage >= Stage.LIFTING and self._last_motion_stage != Stage.PLACING
        self.report(Stage.HOMING, why, plan.side)
        try:
            self._end_gripping(plan)
            left = InterruptedArm(bool(self.in_hand), self._released, self._last_motion, forward_first)
            for motion in plan_way_home(self.model, plan, self._robot.positions(), self._config, left):
                self.follow(motion)
        except StoppedError:
            raise
        except ExecutionError as error:
            _LOG.warning("the arm stays where it is: %s", error)
            return False
        return True

    def lift_clear(self, plan: Plan) -> None:
        """Lift what is held until it is clear of everything, if it can be.

        Raises:
            MotionError: the arm is held up.
        """
        for motion in plan_lift_clear(self.model, plan, self._robot.positions(), self._config):
            self.report(Stage.LIFTING, "first I lift it clear", plan.side)
            self.follow(motion)

    @property
    def is_gripping(self) -> bool:
        """Whether the fingers were stopped on their way."""
        return self._grip.pending is not None

    def _end_gripping(self, plan: Plan) -> None:
        """Let go of what the fingers were about to take or to let go when they were stopped."""
        step = self._grip.pending
        if step is None:
            return
        if step.holding and plan.grasp is not None:
            step = GripStep(step.stage, plan.grasp.opening)
        if step.stage != Stage.PLACING:
            self._grip.move(plan, step)
            return
        try:
            self._grip.release(plan, step)
        except MotionError:
            if not self.in_hand:
                raise
            self._grip.settle()  # it is held yet, and goes where the hand goes
            return
        self.in_hand, self._released = "", True

    def give_up_grasp(self, plan: Plan) -> None:
        """Open, and go back the way that was free on the way in; from above, where what fell may lie, straight home."""
        lifted = self.stage == Stage.LIFTING
        self.report(Stage.RETREATING, "opening the fingers and going back", plan.side)
        stages = (Stage.APPROACHING, Stage.LIFTING) if lifted else (Stage.APPROACHING,)
        moves = [step for step in plan.steps if isinstance(step, MoveStep) and step.stage in stages]
        self._grip.open(plan)
        if lifted and self.recover(plan, "I go back and look where it is"):
            return
        for move in reversed(moves):
            here = self._positions_of(move.trajectory)
            self.follow(started_at(reversed_trajectory(move.trajectory), here))

    def _early_contact(self, plan: Plan) -> float:
        """Return how much earlier than planned [m] an object may come to rest: a dish hangs down from its edge."""
        options, rim = self._options, plan.scene.moved.rim
        if rim is None or plan.grasp is None or plan.grasp.family != "rim":
            return options.early_contact_m
        return max(options.early_contact_m, options.early_contact_radius_ratio * rim.radius)
