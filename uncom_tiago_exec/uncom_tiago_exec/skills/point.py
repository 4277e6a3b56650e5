# SPDX-License-Identifier: Apache-2.0
"""Pointing at an object for the person to see which one is meant."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
from uncom_common.options import ROBOT
from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import InCollisionError, UnreachableError
from uncom_tiago_exec.planning.alternatives import Alternatives, Record
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import GripStep, Plan, Step
from uncom_tiago_exec.skills.motion_steps import end_at, move
from uncom_tiago_exec.skills.options import POINT
from uncom_tiago_exec.skills.skill import ObjectEnd, PlanRequest, Skill
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage


class PointSkill(Skill):
    """Points at an object with closed fingers, and comes back."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.POINT,)
    object_end: ClassVar[ObjectEnd] = ObjectEnd.UNTOUCHED

    def plan(self, request: PlanRequest) -> Plan:
        """Plan to point at the object, and to come back.

        Raises:
            RefusedError: no arm gets there.
        """
        arm, q = pointing(request)
        plan = Plan(arm.side, pointing_steps(arm, q), request.scene)
        return replace(plan, timings_s={"point": time.thread_time() - request.began_s})

    def done_text(self, task: ManipulationTask, held: str) -> str:
        """Return what the robot says."""
        return f"that is the {task.object_text or task.object.label or 'object'}"


def pointing(request: PlanRequest) -> tuple[ArmPlanner, FloatArray]:
    """Return an arm and the configuration (8,) in which its closed fingers point at the moved object.

    Raises:
        RefusedError: no arm gets there.
    """
    arms, scene = request.arms, request.scene
    at = np.array([*scene.moved.middle[:2], scene.moved.top])
    nearer_first = sorted(arms.values(), key=lambda a: -_sign(a) * float(at[1]))

    def reach(option: tuple[ArmPlanner, FloatArray]) -> tuple[ArmPlanner, FloatArray]:
        arm, hand = option
        return arm, arm.solver.solutions(hand, [arm.start], arm.free_motion_checker(0.0), restarts=0)[0]

    return Alternatives(
        ((arm, hand) for arm in nearer_first for hand in _hands(arm, at)),
        reach,
        error=UnreachableError("my hand does not get near enough to point at that"),
        recoverable=(UnreachableError, InCollisionError),
        uninformative=(UnreachableError,),
        record=Record(request.log, "pointing", lambda option: option[0].side),
    ).first()


def _hands(arm: ArmPlanner, at: FloatArray) -> Iterator[FloatArray]:
    """Yield hand poses (4, 4) with the approach axis through a point, from where the arm comes first."""
    azimuth = float(np.arctan2(at[1] - ROBOT.shoulder_y_m * _sign(arm), at[0]))
    for pitch in np.radians(POINT.pitches_deg):
        for yaw in azimuth + np.radians(POINT.yaws_deg):
            pose = np.eye(4)
            pose[:3, 0] = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
            pose[:3, 1] = [-np.sin(yaw), np.cos(yaw), 0.0]
            pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
            pose[:3, 3] = at - (arm.group.gripper.tip + POINT.before_m) * pose[:3, 0]
            yield pose


def pointing_steps(arm: ArmPlanner, q: FloatArray) -> tuple[Step, ...]:
    """Return the steps to a configuration (8,) that points, and back."""
    free = arm.free_motion_checker(0.0)
    go = arm.transit(free, arm.group.clamp(arm.start), [q])
    return (
        GripStep(Stage.APPROACHING, 0.0, detail="closing the fingers"),
        move(arm, Stage.APPROACHING, (go, free, 0.8), "pointing at it"),
        move(arm, Stage.HOMING, (end_at(go[::-1], arm.start), free, 1.0), "back to the start"),
        GripStep(Stage.HOMING, arm.start_gap, detail="fingers as before"),
    )


def _sign(arm: ArmPlanner) -> float:
    return 1.0 if arm.side == "left" else -1.0
