# SPDX-License-Identifier: Apache-2.0
"""What is done for the person to see: pointing at a thing, and holding one out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError, UnreachableError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import carried
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import FloatArray, Side

_BEFORE = 0.07  # [m] between the finger tips and what they point at
_PITCHES = np.radians([40.0, 55.0, 70.0, 25.0, 85.0])
_YAWS = np.radians([0.0, 20.0, -20.0, 45.0, -45.0])
_OUT = ((0.62, 0.18, 0.34), (0.56, 0.15, 0.3), (0.5, 0.2, 0.3), (0.56, 0.3, 0.25))  # ahead, aside, over the table [m]
_TURNS = np.radians([0, 30, -30, 60, -60, 90, -90, 135, -135, 180])


def pointing(arms: Mapping[Side, ArmPlanner], scene: SceneModel) -> tuple[ArmPlanner, FloatArray]:
    """Return an arm and the configuration (8,) in which its closed fingers point at the moved thing.

    Raises:
        RefusedError: no arm gets there.
    """
    error: ExecutionError = UnreachableError("my hand does not get near enough to point at that")
    at = np.array([*scene.moved.middle[:2], scene.moved.top])
    for arm in sorted(arms.values(), key=lambda a: -_sign(a) * float(at[1])):
        for hand in _hands(arm, at):
            try:
                return arm, arm.solver.solutions(hand, [arm.start], arm.free(0.0), restarts=0)[0]
            except UnreachableError:
                continue
            except InCollisionError as err:
                error = err
    raise error


def _hands(arm: ArmPlanner, at: FloatArray) -> Iterator[FloatArray]:
    """Yield hand poses (4, 4) with the approach axis through a point, from where the arm comes first."""
    azimuth = float(np.arctan2(at[1] - 0.19 * _sign(arm), at[0]))
    for pitch in _PITCHES:
        for yaw in azimuth + _YAWS:
            pose = np.eye(4)
            pose[:3, 0] = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
            pose[:3, 1] = [-np.sin(yaw), np.cos(yaw), 0.0]
            pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
            pose[:3, 3] = at - (arm.group.gripper.tip + _BEFORE) * pose[:3, 0]
            yield pose


def held_out(arm: ArmPlanner, grasp: Grasp, lifted: FloatArray) -> FloatArray:
    """Return the way (N, 8) from the lifted thing to where it is held out, upright, over the far half of the table.

    Raises:
        PlanningError: there is no room to hold it out.
    """
    carrying = arm.carrying(grasp, frozenset())
    error: ExecutionError = PlanningError("there is no room to hold that out to you")
    for ahead, aside, above in _OUT:
        for turn in _TURNS:
            pose = np.eye(4)
            cos, sin = np.cos(turn), np.sin(turn)
            pose[:3, :3] = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ grasp.pose[:3, :3]
            pose[:3, 3] = ahead, aside * _sign(arm), arm.scene.table_z + above + arm.scene.moved.height / 2.0
            try:
                goal = arm.solver.solutions(pose, [lifted, arm.start], carrying, restarts=0)[0]
                return carried(arm, grasp, lifted, goal)
            except (UnreachableError, InCollisionError, PlanningError) as err:
                error = err
    raise PlanningError("there is no room to hold that out to you") from error


def _sign(arm: ArmPlanner) -> float:
    return 1.0 if arm.side == "left" else -1.0
