# SPDX-License-Identifier: Apache-2.0
"""An act of one's own: the hand hovers over the object and comes back, planned like every other act.

An act is one class and its registration. Here it takes the place of pointing; an act with words of its own also gets
a `Primitive` and verbs in the language's lexicon (docs/extend/add_an_act.md).

Run it with: ./uncom exec python examples/08_own_skill.py
"""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from uncom_common.primitive import Primitive
from uncom_sim.bench_planning.scenes import pick_and_place
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, UnreachableError
from uncom_tiago_exec.planning.alternatives import Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import MoveStep, Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.skills.manipulation_planner import ManipulationPlanner
from uncom_tiago_exec.skills.motion_steps import move
from uncom_tiago_exec.skills.registry import SkillRegistry
from uncom_tiago_exec.skills.skill import ObjectEnd, PlanRequest, Skill
from uncom_tiago_exec.types import ManipulationTask, Stage

HOVER_M = 0.12  # between the fingertips and the object


class HoverSkill(Skill):
    """Holds the open hand over an object, and comes back."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.POINT,)
    object_end: ClassVar[ObjectEnd] = ObjectEnd.UNTOUCHED

    def plan(self, request: PlanRequest) -> Plan:
        """Plan with the first arm that gets there."""

        def with_arm(arm: ArmPlanner) -> Plan:
            hand = np.eye(4)
            hand[:3, :3] = np.column_stack([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # straight down
            middle = request.scene.moved.middle
            hand[:3, 3] = *middle[:2], request.scene.moved.top + HOVER_M + arm.group.gripper.tip
            free = arm.free_motion_checker(arm.start_gap)
            goals = arm.solver.solutions(hand, [arm.start], free, count=3)
            path = arm.transit(free, arm.group.clamp(arm.start), goals)
            there = move(arm, Stage.APPROACHING, (path, free, 1.0), "over it")
            back = move(arm, Stage.HOMING, (path[::-1], free, 1.0), "back to the start")
            return Plan(arm.side, (there, back), request.scene)

        return Alternatives(
            request.arms.values(),
            with_arm,
            error=UnreachableError("no arm gets over that"),
            recoverable=(UnreachableError, InCollisionError, PlanningError),
        ).first()

    def done_text(self, task: ManipulationTask, held: str) -> str:
        """Return what the robot says."""
        del held
        return f"there is the {task.object_text}"


robot = RobotModel(tiago_urdf())
planner = ManipulationPlanner(robot, ExecutionConfig(), SkillRegistry([HoverSkill()]))
task = replace(pick_and_place(np.random.default_rng(2), 5, 1.0), primitive=Primitive.POINT)
plan = planner.plan(task, home_positions(0.35, (0.0, -0.95), 0.02))
print(f"planned in {plan.planning_s:.2f} s with the {plan.side} arm:")
for step in plan.steps:
    if isinstance(step, MoveStep):
        print(f"  {step.stage.name.lower():12} {step.trajectory.times[-1]:.1f} s  {step.detail}")
print(HoverSkill().done_text(task, held=""))
