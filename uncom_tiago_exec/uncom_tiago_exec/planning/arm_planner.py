# SPDX-License-Identifier: Apache-2.0
"""One arm in one scene: collision checkers for each phase of a manipulation, and single motions planned with them."""

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
from uncom_tiago_exec.planning.joint_planner import JointPlanner
from uncom_tiago_exec.planning.options import ARM_PLANNER, PLANNER, ArmPlannerOptions
from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.joint_names import finger_joints
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import TABLE, attach
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.trajectory.time_parameterization import MotionLimits, time_path
from uncom_tiago_exec.types import Attachment, FloatArray, Obstacle, Side, Trajectory

TABLE_ONLY = frozenset({TABLE})


class ArmPlanner:
    """Plans for torso and one arm from given joint positions; all other joints stay as they are.

    Attributes:
        side: of the arm.
        scene: obstacles and the object to move, in base_footprint.
        config: of the execution node.
        group: torso and arm, with the fingers wide open.
        start: joint vector (8,) that planning starts from.
        start_gap: gap between the fingers there [m].
        last_grasp_configuration: last configuration (8,) that reached a grasp, a seed for the next one; None before.
        solver: inverse kinematics of the group.
        margins: of motions near the object or the place.
        free_margins: of free motions.
        limits: velocity, acceleration and jerk of the motions.
    """

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
        """Prepare to plan; models and checkers are made when they are first needed.

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
        self._carried_grasp: Grasp | None = None  # the grasp that the checkers below are made for
        self._carry_checkers: dict[frozenset[str], CollisionChecker] = {}
        self.group = self._group(robot.gripper(side).open)
        self.start = self.group.vector(positions)
        self.start_gap = sum(positions.get(name, 0.0) for name in finger_joints(side))
        self.last_grasp_configuration: FloatArray | None = None
        self.solver = IkSolver(self.group, config.seed)
        self.margins = Margins(scene=config.scene_margin, fingers=config.finger_margin)
        self.free_margins = replace(self.margins, fingers=max(config.finger_margin, self._options.free_finger_margin_m))
        speed = np.array(self.group.velocity) * config.speed
        acceleration = np.array([config.torso_acceleration] + [config.arm_acceleration] * 7)
        self.limits = MotionLimits(speed, acceleration, config.jerk_ratio)

    def _group(self, gap: float) -> ArmGroup:
        """Return the group with the fingers locked at a gap [m], rounded up to the next step."""
        key = float(np.ceil(gap / self._options.gap_step_m - 1e-6) * self._options.gap_step_m)
        if key not in self._groups:
            fingers = {
                name: min(self._options.finger_limit_m, max(0.0, key / 2.0)) for name in finger_joints(self.side)
            }
            self._groups[key] = self._robot.group(self.side, {**self._positions, **fingers})
        return self._groups[key]

    def _checker(self, gap: float, kind: str, obstacles: tuple[Obstacle, ...], contacts: Contacts) -> CollisionChecker:
        """Return the checker of a kind ("free", "approach", "push") at a finger gap [m], made once."""
        group = self._group(gap)
        key = (round(gap / self._options.gap_step_m + 0.499), kind)
        if key not in self._checkers:
            margins = self.free_margins if kind == "free" else self.margins
            self._checkers[key] = self._with_start_allowed(CollisionChecker(group, obstacles, margins, contacts))
        return self._checkers[key]

    def _with_start_allowed(self, checker: CollisionChecker) -> CollisionChecker:
        """Lower the margins of a checker at the start, and return it: tucked arms are nearer to the body."""
        home = self.group.clamp(self.start)
        if not checker.is_free(home):
            checker.lower_margins_at(home)
        return checker

    def free_motion_checker(self, gap: float) -> CollisionChecker:
        """Return the checker of motions with the hand empty, at a finger gap [m], through the scene as it is."""
        return self._checker(gap, "free", self.scene.obstacles(with_moved=True), Contacts())

    def approach_checker(self, gap: float) -> CollisionChecker:
        """Return the checker of the last straight motion to the object, which the fingers may touch."""
        contacts = Contacts(fingers=frozenset({self.scene.moved.name}))
        return self._checker(gap, "approach", self.scene.obstacles(with_moved=True), contacts)

    def push_checker(self, gap: float) -> CollisionChecker:
        """Return the checker of motions that push the object, which is no obstacle as it moves along."""
        return self._checker(gap, "push", self.scene.obstacles(with_moved=False), Contacts())

    def carry_checker(self, grasp: Grasp, touches: frozenset[str]) -> CollisionChecker:
        """Return the checker of motions with the object in the hand, which may touch obstacles of some names."""
        if self._carried_grasp is not grasp:  # by identity, which is safe as a reference to it is kept
            self._carried_grasp = grasp
            self._carry_checkers.clear()
        if touches not in self._carry_checkers:
            obstacles, contacts = self.scene.obstacles(with_moved=False), Contacts(held=touches)
            self._carry_checkers[touches] = CollisionChecker(
                self._group(grasp.width), obstacles, self.margins, contacts, self.attachment(grasp)
            )
        return self._carry_checkers[touches]

    def attachment(self, grasp: Grasp) -> Attachment:
        """Return the solids of the object relative to the grasping frame."""
        return attach(self.scene.moved_solids, grasp.pose)

    def retreat_checker(self, gap: float, motion: FloatArray, touches: frozenset[str]) -> CollisionChecker:
        """Return the checker of motions with the hand empty after the object was moved.

        Args:
            gap: between the fingers [m].
            motion: of the object in base_footprint (4, 4).
            touches: names of obstacles that the fingers may touch.
        """
        moved = tuple(Obstacle(s.name, s.shape, s.size, motion @ s.pose) for s in self.scene.moved_solids)
        obstacles = (*self.scene.obstacles(with_moved=False), *moved)
        margins = self.margins if touches else self.free_margins
        return self._with_start_allowed(
            CollisionChecker(self._group(gap), obstacles, margins, Contacts(fingers=touches))
        )

    def retreat_from_turned_checker(self, gap: float, motion: FloatArray) -> CollisionChecker:
        """Return the checker of motions with the hand empty after the object was pushed and may have turned.

        The object is enclosed by an upright cylinder.

        Args:
            gap: between the fingers [m].
            motion: of the object in base_footprint (4, 4).
        """
        pushed = self.scene.moved
        diameter = float(np.linalg.norm(pushed.size[:2]))
        pose = np.eye(4)
        pose[:3, 3] = (motion @ np.append(pushed.middle, 1.0))[:3]
        pose[2, 3] = 0.5 * (pushed.bottom + pushed.top)
        turned = Obstacle(pushed.name, "cylinder", (diameter, diameter, pushed.height), pose)
        obstacles = (*self.scene.obstacles(with_moved=False), turned)
        return self._with_start_allowed(CollisionChecker(self._group(gap), obstacles, self.free_margins, Contacts()))

    @property
    def search_time_s(self) -> float:
        """Processor time that the search of one path may take [s]."""
        return self.config.planning_time_s * self._options.search_share

    def transit(self, checker: CollisionChecker, start: FloatArray, goals: Sequence[FloatArray]) -> FloatArray:
        """Return a free path (N, 8) from a start (8,) to one of the goals (8,).

        Where start or goals do not keep the larger finger margin of free motions it is lowered to what they have.

        Raises:
            InCollisionError: the start touches something.
            PlanningError: no path was found in the time.
        """
        if checker.margins is self.free_margins:
            for end in (start, *goals):
                if not checker.is_free(end):
                    checker.lower_margins_at(end)
        return JointPlanner(checker, replace(PLANNER, time_s=self.search_time_s)).plan(start, goals)

    def straight(self, checker: CollisionChecker, start: FloatArray, offset: FloatArray) -> FloatArray:
        """Return the path (N, 8) of the hand straight from a start (8,) by an offset (3,) in base_footprint [m].

        Raises:
            PlanningError: the arm cannot follow the line.
            InCollisionError: an obstacle is in the way.
        """
        pose = self.group.forward(start)
        pose[:3, 3] += offset
        return straight_path(self.solver, checker, start, pose)

    def timed(self, path: FloatArray, checker: CollisionChecker, speed_scale: float = 1.0) -> Trajectory:
        """Return the motion along a path, checked; where the blended corners collide they are made tighter.

        Args:
            path: waypoints (N, 8).
            checker: the motion has to be free according to it.
            speed_scale: share of the usual speed, in (0, 1].

        Raises:
            PlanningError: even nearly sharp corners collide, although the path itself does not.
        """
        limits = self.limits.scaled(speed_scale)
        for radius in self._options.corner_radii:
            trajectory = time_path(self.group.joint_names, path, limits, radius=radius)
            if checker.path_is_free(self.group.clamp(trajectory.positions[1:-1])):
                return trajectory
        raise PlanningError("the motion cannot be smoothed without touching something")

    def timed_unchecked(self, path: FloatArray, speed_scale: float) -> Trajectory:
        """Return the motion along a path (N, 8) that was checked before: tight corners, a share of the usual speed."""
        radius = self._options.corner_radii[-1]
        return time_path(self.group.joint_names, path, self.limits.scaled(speed_scale), radius=radius)

    def lift_path(self, checker: CollisionChecker, q: FloatArray, heights: Sequence[float]) -> FloatArray:
        """Return the straight path (N, 8) up from q (8,) by the first of the heights [m] that is possible.

        Raises:
            PlanningError: the arm cannot follow the line by the last of them.
            InCollisionError: an obstacle is in the way of the last of them.
        """

        def rise(height: float) -> FloatArray:
            return self.straight(checker, q, np.array([0.0, 0.0, height]))

        error = PlanningError("no height to lift to was given")
        return Alternatives(heights, rise, error=error, recoverable=BLOCKED).first()
