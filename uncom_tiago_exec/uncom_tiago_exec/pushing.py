# SPDX-License-Identifier: Apache-2.0
"""Pushing a thing over the table: two open fingers behind it, straight on, and up again.

Flat dishes go this way, whose weight no pinch of their edge can hold, and whatever is to be pushed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from uncom_tiago_exec.arm_planner import ArmPlanner
from uncom_tiago_exec.exceptions import ExecutionError, InCollisionError, PlanningError, RefusedError, UnreachableError
from uncom_tiago_exec.obstacles import on_table
from uncom_tiago_exec.scene_model import SceneModel
from uncom_tiago_exec.shapes import thin
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Side

GAP = 0.07  # [m] between the fingers: both touch, and what is round stays between them
FARTHEST = 0.45  # [m]
_BEFORE = 0.025  # [m] free way before the fingers touch
_ABOVE = 0.004  # [m] of the finger tips over the table
_CLEAR = 0.012  # [m] between what is pushed and what it passes
_TILTS = np.radians([0.0, 15.0, -15.0, 30.0, -30.0])
_UP = (0.12, 0.08, 0.05)


@dataclass(frozen=True, slots=True)
class Push:
    """Joint paths of a push that works: down behind the thing, along with it, and up."""

    arm: ArmPlanner
    down: FloatArray
    along: FloatArray
    up: FloatArray
    motion: FloatArray

    def cost(self) -> float:
        """Rough time of the free motions [s]."""
        speed = self.arm.group.velocity
        ends = ((self.arm.start, self.down[0]), (self.up[-1], self.arm.start))
        return float(sum((np.abs(b - a) / speed).max() for a, b in ends))


def find_push(arms: Mapping[Side, ArmPlanner], scene: SceneModel, task: ManipulationTask, goal: FloatArray) -> Push:
    """Return the quicker arm's push of the moved thing's middle to a place (2,) on the table.

    Raises:
        RefusedError: too far, off the table, something in between, or out of reach; the text says which.
    """
    what = task.object_text or scene.moved.name
    way = goal - scene.moved.middle[:2]
    length = float(np.linalg.norm(way))
    if length > FARTHEST:
        raise RefusedError(f"{length * 100:.0f} cm is too far to push the {what}")
    if length < 0.01:
        raise RefusedError(f"the {what} is already there")
    _check_way(scene, task, way, what)
    found: list[Push] = []
    error: ExecutionError = UnreachableError(f"the {what} is out of reach of both arms to push it there")
    for arm in arms.values():
        for start, end in _hands(arm, scene, way / length, length):
            try:
                found.append(_push(arm, start, end, way))
                break
            except UnreachableError:
                continue
            except (InCollisionError, PlanningError) as err:
                error = err
    if not found:
        if isinstance(error, InCollisionError):
            raise InCollisionError(f"I cannot get behind the {what} to push it there", error.contacts)
        raise error
    return min(found, key=Push.cost)


def _check_way(scene: SceneModel, task: ManipulationTask, way: FloatArray, what: str) -> None:
    """Refuse a push off the table or against something else."""
    points = thin(scene.moved.points, 0.008)
    if task.table is not None and not on_table(task.table, scene.moved.middle[:2] + way, 0.03):
        raise RefusedError(f"the place for the {what} is not on the table")
    others = scene.neighbours
    low = others[others[:, 2] < scene.moved.top + 0.01, :2] if len(others) else np.zeros((0, 2))
    if not len(low):
        return
    tree = cKDTree(low)
    for share in np.linspace(0.0, 1.0, max(2, int(np.linalg.norm(way) / 0.02))):
        distance, _ = tree.query(points[:, :2] + share * way)
        if float(np.min(distance)) < _CLEAR and share > 0.0:
            raise InCollisionError(f"something is in the way of the {what} over the table")


def _hands(
    arm: ArmPlanner, scene: SceneModel, ahead: FloatArray, length: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield poses (4, 4) of the hand before and after, the steepest first."""
    gripper, moved = arm.group.gripper, scene.moved
    side = np.array([-ahead[1], ahead[0]])
    local = moved.points[:, :2] - moved.middle[:2]
    lateral = np.abs(local @ side)
    touched = local[np.abs(lateral - GAP / 2.0) < 0.02] if moved.size[1] > GAP else local
    behind = float(-(touched @ ahead).min()) if len(touched) else float(moved.size[0]) / 2.0
    for tilt in _TILTS:
        for sign in (1.0, -1.0):
            pose = np.eye(4)
            pose[:3, 0] = [*(np.sin(tilt) * ahead), -np.cos(tilt)]
            pose[:3, 1] = [*(sign * side), 0.0]
            pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
            reach = gripper.half_width * float(np.cos(tilt))  # of the pads ahead of their middle
            tips = scene.table_z + _ABOVE + gripper.half_width * abs(float(np.sin(tilt)))
            contact = moved.middle[:2] - ahead * (behind + reach)
            start, end = pose.copy(), pose.copy()
            for hand, shift in ((start, -_BEFORE), (end, length)):
                hand[:2, 3] = contact + ahead * shift
                hand[2, 3] = tips
                hand[:3, 3] -= gripper.tip * pose[:3, 0]
            yield start, end


def _push(arm: ArmPlanner, start: FloatArray, end: FloatArray, way: FloatArray) -> Push:
    pushing = arm.pushing(GAP)
    motion = np.eye(4)
    motion[:2, 3] = way
    error: ExecutionError = PlanningError("no straight way to push")
    for q in arm.solver.solutions(start, [arm.start], pushing, count=4, restarts=0):
        try:
            along = arm.straight(pushing, q, end[:3, 3] - start[:3, 3])
            down = arm.lift_height(pushing, q, _UP)[::-1]
            return Push(arm, down, along, arm.lift_height(pushing, along[-1], _UP), motion)
        except (InCollisionError, PlanningError) as err:
            error = err
    raise error
