# SPDX-License-Identifier: Apache-2.0
"""What all skills have in common that take the object between the fingers.

Grasps of both arms are tried in the order of their worth; one counts only if the hand also gets to the destination with
it, with straight paths in and out. Of the first few that work, the quickest is taken.
"""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace

from uncom_tiago_exec.exceptions import ExecutionError, PlanningError, RefusedError
from uncom_tiago_exec.grasping.grasps import Grasp, grasp_candidates
from uncom_tiago_exec.planning.alternatives import Alternatives, Record
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan, Step
from uncom_tiago_exec.skills.grasp_search import rank_grasps, same_grasp, search_grasps
from uncom_tiago_exec.skills.motion_steps import Reach
from uncom_tiago_exec.skills.options import GRASPING
from uncom_tiago_exec.skills.skill import PlanRequest, Skill
from uncom_tiago_exec.types import ManipulationTask


class GraspingSkill(Skill):
    """A skill that begins with a grasp; subclasses say which grasps serve, and what comes after the grasp."""

    @abstractmethod
    def steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return the steps of a grasp that works; strict, only if the object stays upright on its way.

        Raises:
            ExecutionError: the free motions between its straight parts are not possible.
        """

    def serves(self, grasp: Grasp) -> bool:
        """Tell whether what is to be done can be done with a grasp at all."""
        return True

    def rounds(self, ordered: Sequence[tuple[ArmPlanner, Grasp]]) -> list[Sequence[tuple[ArmPlanner, Grasp]]]:
        """Return which grasps, best first, are searched in each round; the next round follows where one finds none."""
        return [ordered]

    def grasps(self, request: PlanRequest) -> list[Grasp]:
        """Return the grasps that serve and have not failed before."""
        scene = request.scene
        found = grasp_candidates(scene.moved, scene.neighbours, request.arms["left"].group.gripper)
        return [g for g in found if self.serves(g) and not any(same_grasp(g.pose, bad) for bad in request.avoid)]

    def plan(self, request: PlanRequest) -> Plan:
        """Plan by the quickest of the best grasps.

        Raises:
            RefusedError: it cannot be done; the text says why.
        """
        return self.plan_with(request, self.grasps(request))

    def plan_with(self, request: PlanRequest, grasps: Sequence[Grasp]) -> Plan:
        """Plan by one of some grasps.

        Raises:
            RefusedError: none of them works; the text says why.
        """
        if not grasps:
            raise RefusedError(f"I see no way to take hold of the {request.task.object_text or 'object'}")
        found_at = time.thread_time()
        reaches = self._search(request, rank_grasps(request.arms, grasps, request.goal, request.like))
        searched_at = time.thread_time()
        plan = self._connect(request, reaches)
        timings = {
            "grasps": found_at - request.began_s,
            "search": searched_at - found_at,
            "connect": time.thread_time() - searched_at,
        }
        return replace(plan, timings_s=timings)

    def _search(self, request: PlanRequest, ordered: Sequence[tuple[ArmPlanner, Grasp]]) -> list[Reach]:
        """Return the grasps that work, of the first round that has any."""
        error = PlanningError("there is no grasp to look for")
        rounds = self.rounds(ordered)
        return Alternatives(
            rounds, lambda some: search_grasps(some, request), error=error, recoverable=(RefusedError,)
        ).first()

    def _connect(self, request: PlanRequest, reaches: Sequence[Reach]) -> Plan:
        """Plan the free motions between the straight parts of the best reach, or of another if those wind."""
        error: ExecutionError = PlanningError("no grasp was found")
        for strict in (True, False):
            plans = self._connected(request, reaches, error, strict=strict)
            best: tuple[float, Plan] | None = None
            for quality, plan in plans:
                if plan.duration_s <= GRASPING.most_detour * plan.shortest_s:
                    return plan
                cost = plan.duration_s / max(quality, 0.05)
                if best is None or cost < best[0]:
                    best = cost, plan
            if best is not None:
                return best[1]
            error = plans.error
        raise error

    def _connected(
        self, request: PlanRequest, reaches: Sequence[Reach], error: ExecutionError, *, strict: bool
    ) -> Alternatives[Reach, tuple[float, Plan]]:
        """Return the plans of grasps, each with the quality of its grasp; error is the last failure before them."""

        def connect(reach: Reach) -> tuple[float, Plan]:
            steps = self.steps(reach, request.task, strict=strict)
            place = reach.place
            plan = Plan(reach.arm.side, steps, request.scene, reach.grasp, place.motion if place else None)
            return reach.grasp.quality, plan

        def name(reach: Reach) -> str:
            return f"{reach.arm.side}, {reach.grasp.family}, quality {reach.grasp.quality:.2f}"

        stage = f"free motions{', upright' if strict else ''}"
        record = Record(request.log, stage, name)
        return Alternatives(reaches, connect, error=error, recoverable=(ExecutionError,), record=record)
