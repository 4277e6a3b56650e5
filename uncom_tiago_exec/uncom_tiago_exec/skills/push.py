# SPDX-License-Identifier: Apache-2.0
"""Pushing an object over the table: two open fingers behind it, straight on, back a little, and up again.

Flat dishes go this way, whose weight no pinch of their edge can hold, and whatever is to be pushed.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree
from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError, RefusedError, UnreachableError
from uncom_tiago_exec.grasping.place_poses import Destination, destination
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives, Record
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import GripStep, Plan, Step
from uncom_tiago_exec.scene.object_shape import downsample
from uncom_tiago_exec.scene.obstacles import is_on_table
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.skills.motion_steps import end_at, move
from uncom_tiago_exec.skills.options import PUSH
from uncom_tiago_exec.skills.skill import PlanRequest, Skill
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage


class PushSkill(Skill):
    """Pushes an object over the table to its place."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.PUSH,)
    relay_primitive: ClassVar[Primitive | None] = Primitive.PUSH

    def destination(self, task: ManipulationTask, scene: SceneModel) -> Destination:
        """Return where the object is to end.

        Raises:
            RefusedError: there is no place, or it is off the table.
        """
        return destination(task, scene.moved, scene.target)

    def plan(self, request: PlanRequest) -> Plan:
        """Plan the quickest push that works.

        Raises:
            RefusedError: it cannot be pushed there; the text says why.
        """
        return plan_push(request)


def plan_push(request: PlanRequest) -> Plan:
    """Plan to push the object to its destination.

    Raises:
        RefusedError: it cannot be pushed there; the text says why.
    """
    if request.goal is None:
        raise RefusedError(f"I do not know where to push the {request.task.object_text or 'object'}")
    pushes = find_pushes(request, request.goal)
    options = [(push, turned) for turned in (True, True, False) for push in pushes]

    def connect(option: tuple[PushPath, bool]) -> Plan:
        push, turned = option
        return Plan(push.arm.side, pushing_steps(push, turned=turned), request.scene, None, push.motion)

    def name(option: tuple[PushPath, bool]) -> str:
        return f"{option[0].arm.side}, {'room to turn' if option[1] else 'as pushed'}"

    error = PlanningError("no push was found")
    record = Record(request.log, "free motions of a push", name)
    plan = Alternatives(options, connect, error=error, recoverable=(ExecutionError,), record=record).first()
    return replace(plan, timings_s={"push": time.thread_time() - request.began_s})


@dataclass(frozen=True, slots=True)
class PushPath:
    """Joint paths of a push that works: down behind the object, along with it, and back and up."""

    arm: ArmPlanner
    down: FloatArray
    along: FloatArray
    up: FloatArray
    motion: FloatArray
    gap: float  # [m] of the fingers

    def cost(self) -> float:
        """Rough time of the free motions [s]."""
        speed = self.arm.group.velocity
        ends = ((self.arm.start, self.down[0]), (self.up[-1], self.arm.start))
        return float(sum((np.abs(b - a) / speed).max() for a, b in ends))


def _gap(scene: SceneModel) -> float:
    return min(PUSH.most_gap_m, PUSH.gap_share * float(scene.moved.size[1]))


def find_pushes(request: PlanRequest, goal: Destination) -> list[PushPath]:
    """Return pushes of the moved object's middle to its destination on the table, the quickest first, some of each arm.

    Raises:
        RefusedError: too far, off the table, something in between, or out of reach; the text says which.
    """
    task, scene = request.task, request.scene
    what = task.object_text or scene.moved.name
    way = goal.xy - scene.moved.middle[:2]
    length = float(np.linalg.norm(way))
    if length > PUSH.farthest_m:
        raise RefusedError(f"{length * 100:.0f} cm is too far to push the {what}")
    if length < PUSH.there_m:
        raise RefusedError(f"the {what} is already there")
    _check_way(scene, task, way, what)
    found: list[PushPath] = []
    error: ExecutionError = UnreachableError(f"the {what} is out of reach of both arms to push it there")
    for arm in request.arms.values():
        pushes = _pushes_of(arm, request, way, error)
        found += islice(pushes, PUSH.enough)
        error = pushes.error
    if not found:
        if isinstance(error, InCollisionError):
            raise InCollisionError(f"I cannot get behind the {what} to push it there", error.contacts)
        raise error
    return sorted(found, key=PushPath.cost)


def _pushes_of(
    arm: ArmPlanner, request: PlanRequest, way: FloatArray, error: ExecutionError
) -> Alternatives[tuple[FloatArray, FloatArray], PushPath]:
    """Return the pushes of one arm along a way (2,), as alternatives; error is the last failure before them."""
    length = float(np.linalg.norm(way))
    return Alternatives(
        _hands(arm, request.scene, way / length, length),
        lambda hands: _push(arm, *hands, way),
        error=error,
        uninformative=(UnreachableError,),
        record=Record(request.log, "push", lambda _: arm.side),
    )


def _check_way(scene: SceneModel, task: ManipulationTask, way: FloatArray, what: str) -> None:
    """Refuse a push off the table or against something else."""
    points = downsample(scene.moved.points, 0.008)
    if task.table is not None and not is_on_table(task.table, scene.moved.middle[:2] + way, 0.03):
        raise RefusedError(f"the place for the {what} is not on the table")
    others = scene.neighbours
    low = others[others[:, 2] < scene.moved.top + 0.01, :2] if len(others) else np.zeros((0, 2))
    if not len(low):
        return
    tree = cKDTree(low)
    for share in np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(way) / 0.02))):
        distance, _ = tree.query(points[:, :2] + share * way)
        if float(np.min(distance)) < PUSH.clearance_m and share > 0.0:
            raise InCollisionError(f"something is in the way of the {what} over the table")


def _hands(
    arm: ArmPlanner, scene: SceneModel, ahead: FloatArray, length: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield poses (4, 4) of the hand before and after, the steepest first."""
    gripper, moved = arm.group.gripper, scene.moved
    side = np.array([-ahead[1], ahead[0]])
    local = moved.points[:, :2] - moved.middle[:2]
    lateral = np.abs(local @ side)
    touched = local[np.abs(lateral - _gap(scene) / 2.0) < PUSH.finger_width_m]
    behind = float(-(touched @ ahead).min()) if len(touched) else float(moved.size[0]) / 2.0
    for tilt in np.radians(PUSH.tilts_deg):
        for sign in (1.0, -1.0):
            pose = np.eye(4)
            pose[:3, 0] = [*(np.sin(tilt) * ahead), -np.cos(tilt)]
            pose[:3, 1] = [*(sign * side), 0.0]
            pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
            reach = gripper.half_width * float(np.cos(tilt))  # of the pads ahead of their middle
            tips = scene.table_z + PUSH.above_m + gripper.half_width * abs(float(np.sin(tilt)))
            contact = moved.middle[:2] - ahead * (behind + reach)
            start, end = pose.copy(), pose.copy()
            for hand, shift in ((start, -PUSH.before_m), (end, length)):
                hand[:2, 3] = contact + ahead * shift
                hand[2, 3] = tips
                hand[:3, 3] -= gripper.tip * pose[:3, 0]
            yield start, end


def _push(arm: ArmPlanner, start: FloatArray, end: FloatArray, way: FloatArray) -> PushPath:
    gap = _gap(arm.scene)
    pushing = arm.pushing(gap)
    motion = np.eye(4)
    motion[:2, 3] = way
    behind = arm.reaching(gap)  # fingers only: a palm that touched what is tall would tip it over
    touch = (end - start)[:3, 3] * (PUSH.before_m / np.linalg.norm((end - start)[:3, 3]))

    def push_from(q: FloatArray) -> PushPath:
        down = arm.lift_path(behind, q, PUSH.heights_m)[::-1]
        arm.straight(behind, q, touch)
        along = arm.straight(pushing, q, end[:3, 3] - start[:3, 3])
        return PushPath(arm, down, along, _out(arm, along[-1], way), motion, gap)

    solutions = arm.solver.solutions(start, [arm.start], behind, count=4, restarts=0)
    error = PlanningError("no straight way to push")
    return Alternatives(solutions, push_from, error=error, recoverable=BLOCKED).first()


def _out(arm: ArmPlanner, q: FloatArray, way: FloatArray) -> FloatArray:
    """Return the way of the hand back from the object, as far as there is room, and up over it."""
    pushing, ups = (
        arm.pushing(_gap(arm.scene)),
        (max(PUSH.heights_m[0], arm.scene.moved.height + PUSH.over_m), *PUSH.heights_m),
    )
    back = np.append(-way / np.linalg.norm(way), 0.0)

    def leave(distance: float) -> FloatArray:
        if distance == 0.0:
            return arm.lift_path(pushing, q, ups)
        away = arm.straight(pushing, q, distance * back)
        return np.vstack([away, arm.lift_path(pushing, away[-1], ups)[1:]])

    error = PlanningError("no way back from what was pushed")
    return Alternatives((*PUSH.back_m, 0.0), leave, error=error, recoverable=BLOCKED).first()


def pushing_steps(push: PushPath, *, turned: bool) -> tuple[Step, ...]:
    """Return the steps of a push; turned, they leave room for the object whichever way it has turned."""
    arm, gap = push.arm, push.gap
    free, pushing, away = arm.free(gap), arm.pushing(gap), arm.leaving(gap, push.motion, frozenset())
    if turned:
        away = arm.turning_away(gap, push.motion)
    go = arm.transit(free, arm.group.clamp(arm.start), [push.down[0]])
    back = arm.transit(away, push.up[-1], [arm.group.clamp(arm.start)])
    return (
        GripStep(Stage.APPROACHING, gap, detail="opening the fingers"),
        move(arm, Stage.APPROACHING, (go, free, 1.0), "to behind the object"),
        move(arm, Stage.APPROACHING, (push.down, arm.reaching(gap), 0.8), "straight down"),
        move(arm, Stage.TRANSFERRING, (push.along, pushing, 0.5), "pushing"),
        move(arm, Stage.RETREATING, (push.up, pushing, 0.9), "back and up"),
        move(arm, Stage.HOMING, (end_at(back, arm.start), away, 1.0), "back to the start"),
        GripStep(Stage.HOMING, arm.start_gap, detail="fingers as before"),
    )
