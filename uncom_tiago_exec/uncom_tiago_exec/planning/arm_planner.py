# SPDX-License-Identifier: Apache-2.0
"""One arm in one scene: its checkers for each phase of a manipulation, and single motions planned with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from uncom_tiago_exec.collision.collision_checker import CollisionChecker, Contacts
from uncom_tiago_exec.collision.options import Margins
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.kinematics.cartesian_path import straight_path
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives
from uncom_tiago_exec.planning.joint_planner import JointPlanner, PlannerOptions
from uncom_tiago_exec.planning.options import ARM_PLANNER, ArmPlannerOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.joint_names import finger_joints
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import TABLE, attach
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.trajectory.time_parameterization import MotionLimits, time_path
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle, Side, Trajectory


class ArmPlanner:
    """Plans for one side from given joint positions; everything else of the robot stays where it is."""

    def __init__(
        self,
        robot: RobotModel,
        side: Side,
        positions: Mapping[str, float],
        scene: SceneModel,
        config: ExecutionConfig,
        *,
        options: ArmPlannerOptions = ARM_PLANNER,
    ) -> None:
        """Plan with one arm; models and checkers are made when first used.

        Args:
            robot: model of the whole robot.
            side: of the arm that moves, with the torso.
            positions: of all joints [rad, or m] by name, at which every other joint stays.
            scene: in base_footprint.
            config: speeds, margins and planning time.
            options: numbers that tune it.
        """
        self._options = options
        self.side: Side = side
        self.scene = scene
        self.config = config
        self._robot = robot
        self._positions = dict(positions)
        self._groups: dict[float, ArmGroup] = {}
        self._checkers: dict[tuple[float, str], CollisionChecker] = {}
        self._carried: Grasp | None = None  # the grasp that the checkers below are of
        self._carrying: dict[frozenset[str], CollisionChecker] = {}
        self.group = self._group(robot.gripper(side).open)
        self.start = self.group.vector(positions)
        self.start_gap = sum(positions.get(name, 0.0) for name in finger_joints(side))
        self.last_reaching: FloatArray | None = None  # last configuration that reached a grasp
        self.solver = IkSolver(self.group, config.seed)
        self.margins = Margins(scene=config.scene_margin, fingers=config.finger_margin)
        self.free_margins = replace(self.margins, fingers=max(config.finger_margin, self._options.free_finger_margin_m))
        speed = np.array(self.group.velocity) * config.speed
        acceleration = np.array([config.torso_acceleration] + [config.arm_acceleration] * 7)
        self.limits = MotionLimits(speed, acceleration, config.jerk_ratio)

    def _group(self, gap: float) -> ArmGroup:
        """Return the group with fingers locked at a gap, rounded up."""
        key = float(np.ceil(gap / self._options.gap_step_m - 1e-6) * self._options.gap_step_m)
        if key not in self._groups:
            fingers = {name: min(0.045, max(0.0, key / 2.0)) for name in finger_joints(self.side)}
            self._groups[key] = self._robot.group(self.side, {**self._positions, **fingers})
        return self._groups[key]

    def _checker(self, gap: float, kind: str, obstacles: tuple[Obstacle, ...], contacts: Contacts) -> CollisionChecker:
        group = self._group(gap)
        key = (round(gap / self._options.gap_step_m + 0.499), kind)
        if key not in self._checkers:
            margins = self.free_margins if kind == "free" else self.margins
            self._checkers[key] = self._allowing_start(CollisionChecker(group, obstacles, margins, contacts))
        return self._checkers[key]

    def _allowing_start(self, checker: CollisionChecker) -> CollisionChecker:
        """Let the start pose be: tucked arms are nearer to the body than the margin."""
        home = self.group.clamp(self.start)
        if not checker.is_free(home):
            checker.lower_margins_at(home)
        return checker

    def free(self, gap: float) -> CollisionChecker:
        """Check motions with empty hand through the scene as it is."""
        return self._checker(gap, "free", self.scene.obstacles(with_moved=True), Contacts())

    def reaching(self, gap: float) -> CollisionChecker:
        """Check the last straight way to the object, which fingers may touch."""
        contacts = Contacts(fingers=frozenset({self.scene.moved.name}))
        return self._checker(gap, "reaching", self.scene.obstacles(with_moved=True), contacts)

    def pushing(self, gap: float) -> CollisionChecker:
        """Check the hand behind the object it pushes: the object itself gives way."""
        return self._checker(gap, "pushing", self.scene.obstacles(with_moved=False), Contacts())

    def carrying(self, grasp: Grasp, touches: frozenset[str]) -> CollisionChecker:
        """Check motions with the object in the hand, which may touch some solids."""
        if self._carried is not grasp:  # held, so that no other grasp can be taken for it
            self._carried = grasp
            self._carrying.clear()
        if touches not in self._carrying:
            obstacles, contacts = self.scene.obstacles(with_moved=False), Contacts(held=touches)
            self._carrying[touches] = CollisionChecker(
                self._group(grasp.width), obstacles, self.margins, contacts, self.attachment(grasp)
            )
        return self._carrying[touches]

    def attachment(self, grasp: Grasp) -> Attachment:
        """Return the object's solids as they hang in the hand."""
        return attach(self.scene.moved_solids, grasp.pose)

    def leaving(self, gap: float, motion: FloatArray, touches: frozenset[str]) -> CollisionChecker:
        """Check motions with empty hand after the object was moved by `motion` (4, 4); fingers may touch solids."""
        moved = tuple(Obstacle(s.name, s.shape, s.size, motion @ s.pose) for s in self.scene.moved_solids)
        obstacles = (*self.scene.obstacles(with_moved=False), *moved)
        margins = self.margins if touches else self.free_margins
        return self._allowing_start(CollisionChecker(self._group(gap), obstacles, margins, Contacts(fingers=touches)))

    def turning_away(self, gap: float, motion: FloatArray) -> CollisionChecker:
        """Check motions with empty hand after the object was pushed by `motion` (4, 4), in which it may have turned."""
        thing = self.scene.moved
        width = float(np.linalg.norm(thing.size[:2]))
        pose = np.eye(4)
        pose[:3, 3] = (motion @ np.append(thing.middle, 1.0))[:3]
        pose[2, 3] = 0.5 * (thing.bottom + thing.top)
        turned = Obstacle(thing.name, "cylinder", (width, width, thing.height), pose)
        obstacles = (*self.scene.obstacles(with_moved=False), turned)
        return self._allowing_start(CollisionChecker(self._group(gap), obstacles, self.free_margins, Contacts()))

    def transit(self, checker: CollisionChecker, start: FloatArray, goals: Sequence[FloatArray]) -> FloatArray:
        """Plan a free motion (N, 8); its ends may be nearer to objects than fingers keep on free ways.

        Raises:
            InCollisionError, PlanningError: an end touches something, or there is no way.
        """
        if checker.margins is self.free_margins:
            for end in (start, *goals):
                if not checker.is_free(end):
                    checker.lower_margins_at(end)
        options = PlannerOptions(time_s=self.config.planning_time_s / 2.0)
        return JointPlanner(checker, options).plan(start, goals)

    def straight(self, checker: CollisionChecker, start: FloatArray, offset: FloatArray) -> FloatArray:
        """Move the hand straight by an offset (3,) [m]."""
        pose = self.group.forward(start)
        pose[:3, 3] += offset
        return straight_path(self.solver, checker, start, pose)

    def timed(self, path: FloatArray, checker: CollisionChecker, pace: float = 1.0) -> Trajectory:
        """Time a path; where the rounded corners collide they are made tighter.

        Raises:
            PlanningError: even nearly sharp corners collide, which the path itself did not.
        """
        limits = self.limits.scaled(pace)
        for radius in (0.6, 0.25, 0.1, 0.03, 0.01):
            trajectory = time_path(self.group.joint_names, path, limits, radius=radius)
            if checker.path_is_free(self.group.clamp(trajectory.positions[1:-1])):
                return trajectory
        raise PlanningError("the motion cannot be smoothed without touching something")

    def along(self, path: FloatArray, pace: float) -> Trajectory:
        """Time a path that a checked motion has gone, or was to go, with corners as sharp as can be."""
        return time_path(self.group.joint_names, path, self.limits.scaled(pace), radius=0.01)

    def lift_path(self, checker: CollisionChecker, q: FloatArray, heights: Sequence[float]) -> FloatArray:
        """Return the straight way up from q, as high as one of `heights` [m] allows, highest first."""

        def rise(height: float) -> FloatArray:
            return self.straight(checker, q, np.array([0.0, 0.0, height]))

        error = PlanningError("no height to lift to was given")
        return Alternatives(heights, rise, error=error, recoverable=BLOCKED).first()


TABLE_ONLY = frozenset({TABLE})
