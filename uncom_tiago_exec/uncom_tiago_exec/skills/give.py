# SPDX-License-Identifier: Apache-2.0
"""Giving: the object is taken and held out to the person."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import plan_upright_motion
from uncom_tiago_exec.planning.plan import Step
from uncom_tiago_exec.skills.grasping_skill import GraspingSkill
from uncom_tiago_exec.skills.motion_steps import Reach, move, taking_steps
from uncom_tiago_exec.skills.options import GIVE, GiveOptions
from uncom_tiago_exec.skills.skill import ObjectEnd
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage


class GiveSkill(GraspingSkill):
    """Takes an object and holds it out, upright, over the far half of the table."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.GIVE,)
    object_end: ClassVar[ObjectEnd] = ObjectEnd.IN_HAND

    def __init__(self, options: GiveOptions = GIVE) -> None:
        """Take what tunes the skill."""
        self.options = options

    def steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return the steps to the lifted object, and to where it is held out; the arm stays there."""
        taking = taking_steps(reach)
        arm, grasp = reach.arm, reach.grasp
        path = plan_hold_out(arm, grasp, reach.lift[-1], self.options)
        carrying = arm.carry_checker(grasp, frozenset())
        speed_scale = min(reach.carrying_speed_scale, self.options.speed_scale)
        return (*taking, move(arm, Stage.TRANSFERRING, (path, carrying, speed_scale), "holding it out"))

    def done_text(self, task: ManipulationTask, held: str) -> str:
        """Return what the robot says."""
        return f"here is the {held}"


def plan_hold_out(arm: ArmPlanner, grasp: Grasp, lifted: FloatArray, options: GiveOptions = GIVE) -> FloatArray:
    """Return the path (N, 8) from the lifted object (8,) to where it is held out, upright, over the table's far half.

    Raises:
        PlanningError: there is no room to hold it out.
    """
    carrying = arm.carry_checker(grasp, frozenset())
    sign = 1.0 if arm.side == "left" else -1.0

    def hold_out(option: tuple[tuple[float, float, float], float]) -> FloatArray:
        (ahead, aside, above), turn = option
        pose = np.eye(4)
        cos, sin = np.cos(turn), np.sin(turn)
        pose[:3, :3] = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ grasp.pose[:3, :3]
        pose[:3, 3] = ahead, aside * sign, arm.scene.table_z + above + arm.scene.moved.height / 2.0
        goal = arm.solver.solutions(pose, [lifted, arm.start], carrying, restarts=0)[0]
        return plan_upright_motion(arm, grasp, lifted, goal)

    no_room = PlanningError("there is no room to hold that out to you")
    paths = Alternatives(
        ((place, turn) for place in options.places_m for turn in np.radians(options.turns_deg)), hold_out, error=no_room
    )
    for path in paths:
        return path
    raise no_room from paths.error
