# SPDX-License-Identifier: Apache-2.0
"""The whole plan of a task, found before anything moves, by the skill that carries out its primitive."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.exceptions import PlanningError, RefusedError
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives, AttemptLog, Record
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.occlusion import find_occluded_space
from uncom_tiago_exec.scene.scene_model import SceneModel, build_scene, replace_moved
from uncom_tiago_exec.skills.motion_steps import Reach, placing_steps
from uncom_tiago_exec.skills.registry import SKILLS, SkillRegistry
from uncom_tiago_exec.skills.release import plan_release
from uncom_tiago_exec.skills.skill import PlanRequest
from uncom_tiago_exec.types import SIDES, FloatArray, ManipulationTask


class ManipulationPlanner:
    """Plans tasks for a robot."""

    def __init__(self, robot: RobotModel, config: ExecutionConfig, skills: SkillRegistry = SKILLS) -> None:
        """Take the robot to plan for, the node's parameters, and the skills that there are."""
        self.robot = robot
        self.config = config
        self.skills = skills

    def plan(
        self,
        task: ManipulationTask,
        positions: Mapping[str, float],
        avoid: Sequence[FloatArray] = (),
        like: Plan | None = None,
    ) -> Plan:
        """Plan a task from the present joint positions and back to them.

        Motions keep out of the space that is not seen, where that is possible.

        Args:
            task: what is to be done.
            positions: of all joints, by name [rad, m].
            avoid: hand poses (4, 4) that failed before; grasps nearer than 1.5 cm and 20 degrees are left out.
            like: an earlier plan, for nearly the same scene; grasps like its grasp are tried first.

        Raises:
            RefusedError: it cannot be done; the text says why (out of reach, in the way, no place, ...).
        """
        started = time.monotonic()
        scene = build_scene(task)
        goal = self.skills[task.primitive].destination(task, scene)
        shadows = find_occluded_space(scene, self.robot.camera(positions), None if goal is None else goal.xy)
        log = AttemptLog()

        def plan_in(seen: SceneModel) -> Plan:
            began = time.thread_time()
            arms = {side: ArmPlanner(self.robot, side, positions, seen, self.config) for side in SIDES}
            request = PlanRequest(task, seen, goal, arms, self.config, tuple(avoid), like, began, log)
            return self.skills[task.primitive].plan(request)

        plan = Alternatives(
            [replace(scene, shadows=shadows), scene] if shadows else [scene],
            plan_in,
            error=PlanningError("there is no scene to plan in"),
            recoverable=BLOCKED,
            record=Record(log, "scene", lambda seen: "unseen space left out" if seen.shadows else "as seen"),
        ).first()
        return _timed(replace(plan, scene=scene, attempts=tuple(log.attempts)), started)

    def plan_held(self, task: ManipulationTask, positions: Mapping[str, float], held: Plan) -> Plan:
        """Plan to set down what `held` has put into the hand, and to go to where that plan began.

        Raises:
            RefusedError: there is no place, or it cannot be reached; the text says why.
        """
        started, began = time.monotonic(), time.thread_time()
        if held.grasp is None:
            raise RefusedError("I hold nothing")
        scene = replace_moved(build_scene(task), held.scene.moved)
        goal = self.skills[task.primitive].destination(task, scene)
        if goal is None:
            raise RefusedError(f"I do not know where to put the {task.object_text or scene.moved.name}")
        arm = ArmPlanner(self.robot, held.side, positions, scene, self.config)
        here = arm.group.clamp(arm.start)
        lifted = Reach(arm, held.grasp, here[None], np.vstack([here, here]))
        reach = plan_release(arm, held.grasp, goal, lifted, 2)
        steps = placing_steps(reach, held.home, 0.0)
        plan = Plan(held.side, steps, scene, held.grasp, reach.place.motion if reach.place else None)
        return _timed(replace(plan, timings_s={"held": time.thread_time() - began}), started)


def _timed(plan: Plan, started: float) -> Plan:
    """Return a plan with the wall time since it was begun, at `started` [s] of the monotonic clock."""
    seconds = {key: round(value, 4) for key, value in plan.timings_s.items()}
    return replace(plan, planning_s=time.monotonic() - started, timings_s=seconds)
