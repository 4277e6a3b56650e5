# SPDX-License-Identifier: Apache-2.0
"""Carries out a task on a robot: plan, move, grip, check the grip, place, go home, look again.

Runs in a thread of its own and blocks there; it knows the robot only through RobotInterface.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import (
    ExecutionError,
    GraspFailedError,
    InCollisionError,
    MotionError,
    RefusedError,
    StoppedError,
    UnreachableError,
)
from uncom_tiago_exec.nearer import STEPS, room_ahead, seen_from
from uncom_tiago_exec.pick_place import PLACING, PickPlacePlanner
from uncom_tiago_exec.plan import GripStep, MoveStep, Plan
from uncom_tiago_exec.recovery import way_home
from uncom_tiago_exec.robot_interface import RobotInterface
from uncom_tiago_exec.robot_model import RobotModel
from uncom_tiago_exec.sightings import displaced, nearest
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Outcome, Stage, Status, Trajectory
from uncom_tiago_exec.verification import verify

_LOG = logging.getLogger(__name__)
SUPPORTED = (*PLACING, "pick", "push")
_SQUEEZE = 0.03  # [m] the fingers aim this much below what they hold; with 2 cm tolerance each they keep pressing
_EARLY = 0.035  # [m] what hangs lower than thought, for it turned between the fingers, rests this much earlier at most
_SLIPPED = 0.014  # [m] fingers that close this much further have lost what was between them

Report = Callable[[Status], None]


class Engine:
    """One task at a time."""

    def __init__(self, model: RobotModel, robot: RobotInterface, config: ExecutionConfig, report: Report) -> None:
        """Keep the parts; nothing moves yet."""
        self.model = model
        self._planner = PickPlacePlanner(model, config)
        self._robot = robot
        self._config = config
        self._report = report
        self._stage = Stage.IDLE
        self._in_hand = ""
        self._held_gap = 0.0
        self._verification: dict[str, object] = {}
        self._under_way: Plan | None = None
        self._unfinished: Plan | None = None

    def execute(self, task: ManipulationTask) -> Outcome:
        """Carry out a task; every stage is reported, the last one is DONE, FAILED or STOPPED."""
        self._stage = Stage.IDLE
        self._verification = {}
        try:
            self._finish_what_was_stopped()
            text = self._place_held(task) if self._in_hand else self._run(task)
        except StoppedError as error:
            self._unfinished = self._under_way
            return self._end(Stage.STOPPED, str(error))
        except ExecutionError as error:
            return self._end(Stage.FAILED, str(error))
        return self._end(Stage.DONE, text)

    def _finish_what_was_stopped(self) -> None:
        """Go home first if the last command was stopped on its way."""
        if self._unfinished is not None:
            self._recover(self._unfinished, "first I go back to where I began")
            self._unfinished = None

    def _place_held(self, task: ManipulationTask) -> str:
        """Set down what an earlier command has put into the hand."""
        plan = self._under_way
        held = self._in_hand
        if plan is None or _gap(self._robot.positions(), plan.side) < self._held_gap - _SLIPPED:
            self._in_hand = ""
            return self._run(task)
        words = {*task.object_text.lower().split(), task.object.label.lower()}
        if task.primitive not in PLACING or not (words & {*held.lower().split()} or not task.object_text):
            raise RefusedError(f"I hold the {held}; tell me first where to put it")
        self._tell(Stage.PLANNING, f"looking for a place for the {held}", plan.side)
        placing = self._planner.plan_held(task, self._robot.positions(), plan)
        try:
            self._carry(placing)
            self._place(placing)
        except (GraspFailedError, MotionError):
            self._recover(plan)
            raise
        return self._check(task, placing)

    def _end(self, stage: Stage, text: str) -> Outcome:
        before = self._stage
        self._tell(stage, text)
        end = stage if stage == Stage.DONE else before
        return Outcome(stage == Stage.DONE, end, text, self._in_hand, self._verification)

    def _tell(self, stage: Stage, detail: str = "", arm: str = "", data: dict[str, object] | None = None) -> None:
        self._report(Status(stage, detail, arm, data or {}))
        self._stage = stage

    def _run(self, task: ManipulationTask) -> str:
        if task.primitive not in SUPPORTED:
            raise RefusedError(f"I have not learned to {task.primitive.replace('_', ' ')} yet")
        try:
            return self._from_here(task)
        except (UnreachableError, InCollisionError) as refusal:
            if self._in_hand:
                raise
            return self._from_nearer(task, refusal)

    def _from_nearer(self, task: ManipulationTask, refusal: RefusedError) -> str:
        """Drive towards the table as little as lets an arm reach, do it there, and drive back.

        Raises:
            RefusedError: that would not help, or there is no room, or the base cannot be driven.
        """
        room = room_ahead(task.table) if self._config.drive_base else 0.0
        for ahead in STEPS:
            if ahead > room:
                raise refusal
            try:
                self._planner.plan(seen_from(task, ahead), self._robot.positions())
                break
            except ExecutionError as error:
                _LOG.debug("from %.2f m nearer: %s", ahead, error)
        else:
            raise refusal
        self._tell(Stage.APPROACHING, f"driving {ahead * 100:.0f} cm nearer")
        went = self._robot.drive(ahead)
        try:
            return self._from_here(self._look_for(seen_from(task, went)))
        finally:
            if not self._stopped():
                self._robot.drive(-went)

    def _stopped(self) -> bool:
        return isinstance(sys.exc_info()[1], StoppedError)

    def _from_here(self, task: ManipulationTask) -> str:
        failed: list[FloatArray] = []
        for attempt in range(self._config.grasp_attempts):
            plan = self._under_way = self._plan(task, failed, attempt)
            try:
                self._take(task, plan)
                self._carry(plan)
                break
            except MotionError:
                self._recover(plan)
                raise
            except GraspFailedError as error:
                if plan.grasp is not None:
                    failed.append(plan.grasp.pose)
                if self._stage == Stage.TRANSFERRING:
                    self._recover(plan, "I go back and look where it is")
                else:
                    self._give_up_grasp(plan)
                if attempt + 1 == self._config.grasp_attempts:
                    raise
                self._tell(Stage.PLANNING, f"{error}; I try another way", plan.side)
                task = self._look_for(task)
        if task.primitive == "pick":
            return f"I hold the {self._in_hand}"
        try:
            self._place(plan)
        except MotionError:
            self._recover(plan)
            raise
        return self._check(task, plan)

    def _plan(self, task: ManipulationTask, failed: list[FloatArray], attempt: int) -> Plan:
        self._tell(Stage.PLANNING, "looking for a grasp and a way")
        plan = self._planner.plan(task, self._robot.positions(), failed)
        data: dict[str, object] = {
            "attempt": attempt + 1,
            "planning_s": round(plan.planning_s, 4),
            "timings_s": plan.timings_s,
            "motion_s": round(plan.duration_s, 3),
        }
        if plan.grasp is not None:
            data["grasp"] = {
                "family": plan.grasp.family,
                "quality": round(plan.grasp.quality, 3),
                "width_m": round(plan.grasp.width, 4),
                "opening_m": round(plan.grasp.opening, 4),
                "pose": np.round(plan.grasp.pose, 4).tolist(),
            }
        self._tell(Stage.PLANNING, f"planned in {plan.planning_s:.2f} s with the {plan.side} arm", plan.side, data)
        return plan

    def _take(self, task: ManipulationTask, plan: Plan) -> None:
        what = task.object_text or task.object.label or "object"
        holding = False
        for step in plan.steps:
            if step.stage > Stage.LIFTING:
                break
            self._announce(step, plan)
            if isinstance(step, MoveStep):
                self._robot.follow(step.trajectory)
            elif step.holding:
                self._close(plan, what)
                self._in_hand = what
                holding = True
            else:
                self._robot.grip(plan.side, step.gap)
            if holding and step.stage == Stage.LIFTING:
                self._still_held(plan, what, "the {} slipped out of my fingers")

    def _close(self, plan: Plan, what: str) -> None:
        """Close on the thing, press, and tell from the gap whether anything is there."""
        width = plan.grasp.width if plan.grasp is not None else 0.0
        gap = self._robot.grip(plan.side, max(0.0, width - _SQUEEZE))
        gap = self._robot.grip(plan.side, max(0.0, gap - _SQUEEZE))
        if gap < _empty_below(width):
            raise GraspFailedError(f"my fingers closed beside the {what}")
        self._held_gap = gap
        self._tell(Stage.GRASPING, f"holding something {gap * 1000:.0f} mm wide", plan.side, {"gap_m": round(gap, 4)})

    def _still_held(self, plan: Plan, what: str, lost: str) -> None:
        width = plan.grasp.width if plan.grasp is not None else 0.0
        if _gap(self._robot.positions(), plan.side) < max(_empty_below(width), self._held_gap - _SLIPPED):
            self._in_hand = ""
            raise GraspFailedError(lost.format(what))

    def _announce(self, step: MoveStep | GripStep, plan: Plan) -> None:
        data: dict[str, object] = {}
        if isinstance(step, MoveStep):
            data["duration_s"] = round(step.trajectory.duration_s, 3)
        self._tell(step.stage, step.detail, plan.side, data)

    def _carry(self, plan: Plan) -> None:
        """Bring the thing over its place; what is lost on the way is noticed there."""
        for step in plan.steps:
            if isinstance(step, MoveStep) and step.stage == Stage.TRANSFERRING:
                self._announce(step, plan)
                self._robot.follow(step.trajectory)
                if plan.grasp is not None:
                    self._still_held(plan, self._in_hand, "I lost the {} on the way")

    def _place(self, plan: Plan) -> None:
        """Set the thing down, let go, and go home.

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
                    self._robot.follow(started_at(step.trajectory, self._positions_of(step.trajectory)))
                else:
                    self._robot.follow(step.trajectory)
            elif step.stage == Stage.PLACING:
                self._announce(step, plan)
                self._robot.grip(plan.side, step.gap)
                self._in_hand = ""
            else:
                self._robot.grip(plan.side, step.gap)

    def _lower(self, step: MoveStep, plan: Plan) -> bool:
        """Lower the thing; return False if it rests on something a little before the end.

        Raises:
            MotionError: the motion ended elsewhere.
        """
        try:
            self._robot.follow(step.trajectory)
        except MotionError:
            group = self.model.group(plan.side, self._robot.positions())
            here = group.forward(self._positions_of(step.trajectory))
            if float(np.linalg.norm((here - group.forward(step.trajectory.positions[-1]))[:3, 3])) > _EARLY:
                raise
            return False
        return True

    def _positions_of(self, trajectory: Trajectory) -> FloatArray:
        positions = self._robot.positions()
        return np.array([positions[name] for name in trajectory.joint_names])

    def _recover(self, plan: Plan, why: str = "something went wrong; I go back to where I began") -> None:
        """Go home after a fault without dropping what is held, if there is a free way; else stay."""
        self._tell(Stage.HOMING, why, plan.side)
        try:
            positions = self._robot.positions()
            for motion in way_home(self.model, plan, positions, self._config, holding=bool(self._in_hand)):
                self._robot.follow(motion)
        except StoppedError:
            raise
        except ExecutionError as error:
            _LOG.warning("the arm stays where it is: %s", error)

    def _give_up_grasp(self, plan: Plan) -> None:
        """Open, and go the way back that was free on the way in."""
        self._tell(Stage.RETREATING, "opening the fingers and going back", plan.side)
        moves = [s for s in plan.steps if isinstance(s, MoveStep) and s.stage == Stage.APPROACHING]
        lifts = [s for s in plan.steps if isinstance(s, MoveStep) and s.stage == Stage.LIFTING]
        if plan.grasp is not None:
            self._robot.grip(plan.side, plan.grasp.opening)
        here = self._positions_of(moves[0].trajectory)
        if self._stage == Stage.RETREATING and lifts and _at_end(lifts[0].trajectory, here):
            self._robot.follow(reversed_trajectory(lifts[0].trajectory))
        for move in reversed(moves):
            self._robot.follow(reversed_trajectory(move.trajectory))

    def _look_for(self, task: ManipulationTask) -> ManipulationTask:
        """Look again and follow the thing to where it is now."""
        scene = self._robot.look()
        thing = nearest(scene, task.object) or displaced(scene, task)
        if thing is None:
            raise GraspFailedError(f"I no longer see the {task.object_text or 'object'}")
        target = nearest(scene, task.target) if task.target is not None else None
        return replace(
            task, object=thing, scene=scene.detections, table=scene.table or task.table, target=target or task.target
        )

    def _check(self, task: ManipulationTask, plan: Plan) -> str:
        if not self._config.verify:
            return f"I have put the {task.object_text or 'object'} down"
        self._tell(Stage.VERIFYING, "looking again")
        finding = verify(task, plan, self._robot.look())
        data = finding.as_data()
        self._verification = data
        self._tell(Stage.VERIFYING, finding.text, plan.side, data)
        if not finding.success:
            raise ExecutionError(finding.text)
        moved = ", ".join(f"the {name} by {distance * 100:.0f} cm" for name, distance in finding.moved)
        return finding.text + (f"; I moved {moved}" if moved else "")


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


def _empty_below(width: float) -> float:
    """Return the gap [m] under which fingers that closed on something `width` wide hold nothing."""
    return max(0.002, 0.3 * width)


def _gap(positions: dict[str, float], side: str) -> float:
    return positions[f"gripper_{side}_left_finger_joint"] + positions[f"gripper_{side}_right_finger_joint"]


def _at_end(trajectory: Trajectory, here: FloatArray) -> bool:
    end, start = trajectory.positions[-1], trajectory.positions[0]
    return bool(np.abs(here - end).max() < np.abs(here - start).max())
