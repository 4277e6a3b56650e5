# SPDX-License-Identifier: Apache-2.0
"""Pushing an object over the table: two open fingers behind it, straight on, back a little, and up again.

Flat dishes are moved like this, whose weight no pinch of their edge can hold, and whatever is to be pushed.
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
from uncom_tiago_exec.skills.options import PUSH, PushOptions
from uncom_tiago_exec.skills.skill import PlanRequest, Skill
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage


class PushSkill(Skill):
    """Pushes an object over the table to its place."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.PUSH,)
    relay_primitive: ClassVar[Primitive | None] = Primitive.PUSH

    def __init__(self, options: PushOptions = PUSH) -> None:
        """Take what tunes the skill."""
        self.options = options

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
        return plan_push(request, self.options)


def plan_push(request: PlanRequest, options: PushOptions = PUSH) -> Plan:
    """Plan to push the object to its destination.

    Raises:
        RefusedError: it cannot be pushed there; the text says why.
    """
    if request.goal is None:
        raise RefusedError(f"I do not know where to push the {request.task.object_text or 'object'}")
    pushes = find_pushes(request, request.goal, options)
    candidates = [(push, turned) for turned in (True, True, False) for push in pushes]

    def connect(option: tuple[PushPath, bool]) -> Plan:
        push, turned = option
        return Plan(push.arm.side, pushing_steps(push, turned=turned), request.scene, None, push.motion)

    def name(option: tuple[PushPath, bool]) -> str:
        return f"{option[0].arm.side}, {'room to turn' if option[1] else 'as pushed'}"

    error = PlanningError("no push was found")
    record = Record(request.log, "free motions of a push", name)
    plan = Alternatives(candidates, connect, error=error, recoverable=(ExecutionError,), record=record).first()
    return replace(plan, timings_s={"push": time.thread_time() - request.began_s})


@dataclass(frozen=True, slots=True)
class PushPath:
    """The joint paths (N, 8) of a push that works.

    Attributes:
        arm: planner of the arm that pushes.
        down: path down behind the object.
        along: path along with the object.
        up: path back from the object and up over it.
        motion: motion (4, 4) of the object.
        gap: between the fingers [m].
    """

    arm: ArmPlanner
    down: FloatArray
    along: FloatArray
    up: FloatArray
    motion: FloatArray
    gap: float

    def cost(self) -> float:
        """Rough time of the free motions [s]."""
        speed = self.arm.group.velocity
        ends = ((self.arm.start, self.down[0]), (self.up[-1], self.arm.start))
        return float(sum((np.abs(b - a) / speed).max() for a, b in ends))


def _finger_gap(scene: SceneModel, options: PushOptions) -> float:
    """Return the gap between the fingers that push the moved object [m]."""
    return min(options.most_gap_m, options.gap_share * float(scene.moved.size[1]))


def find_pushes(request: PlanRequest, goal: Destination, options: PushOptions = PUSH) -> list[PushPath]:
    """Return pushes of the moved object's middle to its destination on the table, the quickest first, some of each arm.

    Raises:
        RefusedError: too far, off the table, something in between, or out of reach; the text says which.
    """
    task, scene = request.task, request.scene
    what = task.object_text or scene.moved.name
    displacement = goal.xy - scene.moved.middle[:2]
    length = float(np.linalg.norm(displacement))
    if length > options.farthest_m:
        raise RefusedError(f"{length * 100:.0f} cm is too far to push the {what}")
    if length < options.there_m:
        raise RefusedError(f"the {what} is already there")
    _check_path(scene, task, displacement, what, options)
    found: list[PushPath] = []
    error: ExecutionError = UnreachableError(f"the {what} is out of reach of both arms to push it there")
    for arm in request.arms.values():
        pushes = _pushes_of(arm, request, displacement, error, options)
        found += islice(pushes, options.enough)
        error = pushes.error
    if not found:
        if isinstance(error, InCollisionError):
            raise InCollisionError(f"I cannot get behind the {what} to push it there", error.contacts)
        raise error
    return sorted(found, key=PushPath.cost)


def _pushes_of(
    arm: ArmPlanner, request: PlanRequest, displacement: FloatArray, error: ExecutionError, options: PushOptions
) -> Alternatives[tuple[FloatArray, FloatArray], PushPath]:
    """Return the pushes of one arm by a displacement (2,) [m], as alternatives; error is the last failure so far."""
    length = float(np.linalg.norm(displacement))
    return Alternatives(
        _hand_poses(arm, request.scene, displacement / length, length, options),
        lambda hands: _plan_path(arm, hands, displacement, options),
        error=error,
        uninformative=(UnreachableError,),
        record=Record(request.log, "push", lambda _: arm.side),
    )


def _check_path(
    scene: SceneModel, task: ManipulationTask, displacement: FloatArray, what: str, options: PushOptions
) -> None:
    """Refuse to push by a displacement (2,) [m] off the table or against another object."""
    points = downsample(scene.moved.points, options.voxel_m)
    if task.table is not None and not is_on_table(
        task.table, scene.moved.middle[:2] + displacement, options.table_margin_m
    ):
        raise RefusedError(f"the place for the {what} is not on the table")
    others = scene.neighbours
    low = others[others[:, 2] < scene.moved.top + options.above_top_m, :2] if len(others) else np.zeros((0, 2))
    if not len(low):
        return
    tree = cKDTree(low)
    for share in np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(displacement) / options.check_step_m))):
        distance, _ = tree.query(points[:, :2] + share * displacement)
        if float(np.min(distance)) < options.clearance_m and share > 0.0:
            raise InCollisionError(f"something is in the way of the {what} over the table")


def _hand_poses(
    arm: ArmPlanner, scene: SceneModel, ahead: FloatArray, length: float, options: PushOptions
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield poses (4, 4) of the hand before and after a push along ahead (2,) by a length [m], the steepest first."""
    gripper, moved = arm.group.gripper, scene.moved
    side = np.array([-ahead[1], ahead[0]])
    local = moved.points[:, :2] - moved.middle[:2]
    lateral = np.abs(local @ side)
    touched = local[np.abs(lateral - _finger_gap(scene, options) / 2.0) < options.finger_width_m]
    behind = float(-(touched @ ahead).min()) if len(touched) else float(moved.size[0]) / 2.0
    for tilt in np.radians(options.tilts_deg):
        for sign in (1.0, -1.0):
            pose = np.eye(4)
            pose[:3, 0] = [*(np.sin(tilt) * ahead), -np.cos(tilt)]
            pose[:3, 1] = [*(sign * side), 0.0]
            pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
            reach = gripper.half_width * float(np.cos(tilt))  # of the pads ahead of their middle
            tips = scene.table_z + options.above_m + gripper.half_width * abs(float(np.sin(tilt)))
            contact = moved.middle[:2] - ahead * (behind + reach)
            start, end = pose.copy(), pose.copy()
            for hand, shift in ((start, -options.before_m), (end, length)):
                hand[:2, 3] = contact + ahead * shift
                hand[2, 3] = tips
                hand[:3, 3] -= gripper.tip * pose[:3, 0]
            yield start, end


def _plan_path(
    arm: ArmPlanner, hands: tuple[FloatArray, FloatArray], displacement: FloatArray, options: PushOptions
) -> PushPath:
    """Plan a push from one hand pose (4, 4) to another, which moves the object by a displacement (2,) [m]."""
    start, end = hands
    gap = _finger_gap(arm.scene, options)
    pushing = arm.push_checker(gap)
    motion = np.eye(4)
    motion[:2, 3] = displacement
    behind = arm.approach_checker(gap)  # fingers only: a palm that touched what is tall would tip it over
    touch = (end - start)[:3, 3] * (options.before_m / np.linalg.norm((end - start)[:3, 3]))

    def push_from(q: FloatArray) -> PushPath:
        down = arm.lift_path(behind, q, options.heights_m)[::-1]
        arm.straight(behind, q, touch)
        along = arm.straight(pushing, q, end[:3, 3] - start[:3, 3])
        return PushPath(arm, down, along, _plan_retreat(arm, along[-1], displacement, options), motion, gap)

    solutions = arm.solver.solutions(start, [arm.start], behind, count=4, restarts=0)
    error = PlanningError("no straight way to push")
    return Alternatives(solutions, push_from, error=error, recoverable=BLOCKED).first()


def _plan_retreat(arm: ArmPlanner, q: FloatArray, displacement: FloatArray, options: PushOptions) -> FloatArray:
    """Return the path (N, 8) of the hand back from the object, as far as there is room, and up over it."""
    pushing, ups = (
        arm.push_checker(_finger_gap(arm.scene, options)),
        (max(options.heights_m[0], arm.scene.moved.height + options.over_m), *options.heights_m),
    )
    back = np.append(-displacement / np.linalg.norm(displacement), 0.0)

    def leave(distance: float) -> FloatArray:
        if distance == 0.0:
            return arm.lift_path(pushing, q, ups)
        away = arm.straight(pushing, q, distance * back)
        return np.vstack([away, arm.lift_path(pushing, away[-1], ups)[1:]])

    error = PlanningError("no way back from what was pushed")
    return Alternatives((*options.back_m, 0.0), leave, error=error, recoverable=BLOCKED).first()


def pushing_steps(push: PushPath, *, turned: bool) -> tuple[Step, ...]:
    """Return the steps of a push; turned, they leave room for the object whichever way it has turned."""
    arm, gap = push.arm, push.gap
    free, pushing, away = (
        arm.free_motion_checker(gap),
        arm.push_checker(gap),
        arm.retreat_checker(gap, push.motion, frozenset()),
    )
    if turned:
        away = arm.retreat_from_turned_checker(gap, push.motion)
    go = arm.transit(free, arm.group.clamp(arm.start), [push.down[0]])
    back = arm.transit(away, push.up[-1], [arm.group.clamp(arm.start)])
    return (
        GripStep(Stage.APPROACHING, gap, detail="opening the fingers"),
        move(arm, Stage.APPROACHING, (go, free, 1.0), "to behind the object"),
        move(arm, Stage.APPROACHING, (push.down, arm.approach_checker(gap), 0.8), "straight down"),
        move(arm, Stage.TRANSFERRING, (push.along, pushing, 0.5), "pushing"),
        move(arm, Stage.RETREATING, (push.up, pushing, 0.9), "back and up"),
        move(arm, Stage.HOMING, (end_at(back, arm.start), away, 1.0), "back to the start"),
        GripStep(Stage.HOMING, arm.start_gap, detail="fingers as before"),
    )
