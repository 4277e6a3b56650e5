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
from uncom_tiago_exec.robot.clearance import Clearance
from uncom_tiago_exec.robot.cover_model import CoverModel
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.link_pairs import link_of_geometry
from uncom_tiago_exec.robot.reach_bounds import ReachBounds
from uncom_tiago_exec.types import FloatArray, Side


class ArmGroup:
    """Torso and one arm (8 joints) with kinematics of the grasping frame; other joints are part of the body."""

    def __init__(
        self,
        side: Side,
        model: Any,
        geometry: Any,
        gripper: GripperShape,
        inset: float = 0.004,
        reach: float | None = None,
    ) -> None:
        """Wrap a reduced model; limits are `inset` [rad, m/10] inside the URDF's; `reach` is measured if None."""
        self.side: Side = side
        self.model = model
        self.geometry = geometry
        self.gripper = gripper
        self.data = model.createData()
        self.joint_names = tuple(str(n) for n in list(model.names)[1:])
        if self.joint_names != group_joints(side):
            raise RobotModelError(f"unexpected joint order {', '.join(self.joint_names)}")
        scale = np.array([inset / 10.0] + [inset] * 7)
        self.lower: FloatArray = np.array(model.lowerPositionLimit) + scale
        self.upper: FloatArray = np.array(model.upperPositionLimit) - scale
        self.velocity: FloatArray = np.array(model.velocityLimit)
        self.tool = model.getFrameId(f"gripper_{side}_grasping_frame")
        pin.framesForwardKinematics(model, self.data, np.zeros(8))
        self._shoulder = np.array(self.data.oMi[model.getJointId(f"arm_{side}_1_joint")].translation)
        wrist = self.data.oMi[model.getJointId(f"arm_{side}_7_joint")]
        self._tool_to_wrist = np.array((self.data.oMf[self.tool].inverse() * wrist).homogeneous)[:, 3]
        self.links = tuple(link_of_geometry(g.name) for g in geometry.geometryObjects)
        self.joints = tuple(int(g.parentJoint) for g in geometry.geometryObjects)
        self.body_pairs: tuple[tuple[int, int], ...] = ()
        self.clearances: dict[tuple[int, int], Clearance] = {}
        self.bounds = ReachBounds(model, geometry, float(self.lower[0]), float(self.upper[0]))
        self.reach = self._measure_reach() if reach is None else reach

    @cached_property
    def covers(self) -> CoverModel:
        """Covers of the shapes, made when they are first needed."""
        return CoverModel(self.model, self.geometry, self.links)

    def _measure_reach(self) -> float:
        """Return how far the wrist (origin of the last joint) can be from the shoulder [m], by sampling."""
        rng = np.random.default_rng(0)
        shoulder, wrist = (self.model.getJointId(f"arm_{self.side}_{i}_joint") for i in (1, 7))
        farthest = 0.0
        for q in rng.uniform(self.lower, self.upper, (1500, 8)):
            pin.forwardKinematics(self.model, self.data, q)
            apart = self.data.oMi[wrist].translation - self.data.oMi[shoulder].translation
            farthest = max(farthest, float(apart @ apart))
        return float(np.sqrt(farthest)) + 0.02

    def within_reach(self, pose: FloatArray) -> bool:
        """Tell quickly whether the wrist of a hand pose (4, 4) can be near enough to the shoulder."""
        x, y, z = (pose[:3] @ self._tool_to_wrist - self._shoulder).tolist()
        risen = min(max(z, float(self.lower[0])), float(self.upper[0]))
        return math.hypot(x, y, z - risen) <= self.reach

    def clamp(self, q: FloatArray) -> FloatArray:
        """Return the nearest configuration inside the limits."""
        return np.clip(q, self.lower, self.upper)

    def vector(self, positions: Mapping[str, float]) -> FloatArray:
        """Read this group's joint vector (8,) from named positions."""
        return np.array([positions[name] for name in self.joint_names])

    def forward(self, q: FloatArray) -> FloatArray:
        """Return the pose (4, 4) of the grasping frame in base_footprint."""
        pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.tool].homogeneous)
