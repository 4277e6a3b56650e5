# SPDX-License-Identifier: Apache-2.0
"""The kinematic group that planning moves: the torso and one arm, eight joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from uncom_tiago_exec.exceptions import RobotModelError
from uncom_tiago_exec.robot.clearance_maps import ClearanceMap
from uncom_tiago_exec.robot.cover_model import CoverModel
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.link_pairs import link_of_geometry
from uncom_tiago_exec.robot.options import ARM_GROUP, ArmGroupOptions
from uncom_tiago_exec.robot.reach_bounds import ReachBounds
from uncom_tiago_exec.types import FloatArray, Side


class ArmGroup:
    """Torso and one arm (8 joints) with the kinematics of the grasping frame; all other joints are locked.

    Attributes:
        side: of the arm.
        model: reduced pinocchio model, its base frame is base_footprint.
        geometry: collision shapes of the whole robot on that model.
        gripper: its measures.
        joint_names: order of joint vectors (8,): torso [m], then the arm from the shoulder on [rad].
        lower: joint limits that planning keeps to (8,), a little inside the URDF's.
        upper: the same at the other end.
        velocity: speed limits of the URDF (8,) [m/s, rad/s].
        tool: index of the grasping frame in the model.
        links: name of the link of each collision shape.
        joints: index of the joint that carries each collision shape.
        body_pairs: pairs of collision shapes that self-collision checks look at.
        clearance_maps: of those pairs that have one.
        bounds: which shapes can come near an obstacle at all.
        reach: greatest distance of the wrist (origin of the last joint) from the shoulder (the first arm joint) [m].
    """

    def __init__(
        self,
        side: Side,
        model: Any,
        geometry: Any,
        gripper: GripperShape,
        reach: float | None = None,
        *,
        options: ArmGroupOptions = ARM_GROUP,
    ) -> None:
        """Wrap a reduced pinocchio model.

        Args:
            side: of the arm.
            model: torso and arm; all other joints are locked in it.
            geometry: collision shapes on that model.
            gripper: measures of the gripper.
            reach: see the class; measured if None.
            options: numbers that tune it.

        Raises:
            RobotModelError: the joints of the model are not those of torso and arm, in that order.
        """
        self._options = options
        self.side: Side = side
        self.model = model
        self.geometry = geometry
        self.gripper = gripper
        self.data = model.createData()
        self.joint_names = tuple(str(n) for n in list(model.names)[1:])
        if self.joint_names != group_joints(side):
            raise RobotModelError(f"unexpected joint order {', '.join(self.joint_names)}")
        inset = np.array([options.limit_inset_rad / 10.0] + [options.limit_inset_rad] * 7)
        self.lower: FloatArray = np.array(model.lowerPositionLimit) + inset
        self.upper: FloatArray = np.array(model.upperPositionLimit) - inset
        self.velocity: FloatArray = np.array(model.velocityLimit)
        self.tool = model.getFrameId(f"gripper_{side}_grasping_frame")
        pin.framesForwardKinematics(model, self.data, np.zeros(8))
        self._shoulder = np.array(self.data.oMi[model.getJointId(f"arm_{side}_1_joint")].translation)
        wrist = self.data.oMi[model.getJointId(f"arm_{side}_7_joint")]
        self._wrist_in_tool = np.array((self.data.oMf[self.tool].inverse() * wrist).homogeneous)[:, 3]
        self.links = tuple(link_of_geometry(g.name) for g in geometry.geometryObjects)
        self.joints = tuple(int(g.parentJoint) for g in geometry.geometryObjects)
        self.body_pairs: tuple[tuple[int, int], ...] = ()
        self.clearance_maps: dict[tuple[int, int], ClearanceMap] = {}
        self.bounds = ReachBounds(model, geometry, float(self.lower[0]), float(self.upper[0]))
        self.reach = self._measure_reach() if reach is None else reach

    @cached_property
    def covers(self) -> CoverModel:
        """Convex covers of the collision shapes, made when they are first needed."""
        return CoverModel(self.model, self.geometry, self.links)

    def _measure_reach(self) -> float:
        """Return the greatest distance of wrist and shoulder [m] over random configurations."""
        rng = np.random.default_rng(0)
        shoulder, wrist = (self.model.getJointId(f"arm_{self.side}_{i}_joint") for i in (1, 7))
        squared = 0.0
        for q in rng.uniform(self.lower, self.upper, (self._options.reach_samples, 8)):
            pin.forwardKinematics(self.model, self.data, q)
            offset = self.data.oMi[wrist].translation - self.data.oMi[shoulder].translation
            squared = max(squared, float(offset @ offset))
        return float(np.sqrt(squared)) + self._options.reach_slack_m

    def within_reach(self, pose: FloatArray) -> bool:
        """Tell whether the wrist of a pose (4, 4) of the grasping frame can be near enough to the shoulder.

        A necessary condition, which is quick to check: the shoulder may be at any height of the torso.
        """
        x, y, z = (pose[:3] @ self._wrist_in_tool - self._shoulder).tolist()
        torso = min(max(z, float(self.lower[0])), float(self.upper[0]))
        return math.hypot(x, y, z - torso) <= self.reach

    def clamp(self, q: FloatArray) -> FloatArray:
        """Return the nearest configuration (8,), or configurations (N, 8), inside the limits."""
        return np.clip(q, self.lower, self.upper)

    def vector(self, positions: Mapping[str, float]) -> FloatArray:
        """Return this group's joint vector (8,) from joint positions by name [rad, or m]."""
        return np.array([positions[name] for name in self.joint_names])

    def forward(self, q: FloatArray) -> FloatArray:
        """Return the pose (4, 4) of the grasping frame in base_footprint at a configuration (8,)."""
        pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.tool].homogeneous)
