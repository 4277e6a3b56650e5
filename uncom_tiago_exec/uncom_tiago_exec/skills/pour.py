# SPDX-License-Identifier: Apache-2.0
"""Pouring: the held object is tilted so that the edge of its mouth stays over the middle of the target.

Its lowest point keeps the same height over the target: it begins above it and comes down as it tips.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation
from uncom_common.primitive import Primitive

from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, RefusedError, UnreachableError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Destination, original_place
from uncom_tiago_exec.kinematics.cartesian_path import follow_poses
from uncom_tiago_exec.planning.alternatives import BLOCKED, Alternatives
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.carry_planner import plan_upright_motion
from uncom_tiago_exec.planning.plan import Plan, Step
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.skills.grasping_skill import GraspingSkill
from uncom_tiago_exec.skills.motion_steps import Reach, move, placing_steps, taking_steps
from uncom_tiago_exec.skills.options import POUR, PourOptions
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Stage

_LOG = logging.getLogger(__name__)


class PourSkill(GraspingSkill):
    """Takes a vessel, tilts it over the target, and sets it down where it was."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.POUR,)

    def __init__(self, options: PourOptions = POUR) -> None:
        """Take what tunes the skill."""
        self.options = options

    def destination(self, task: ManipulationTask, scene: SceneModel) -> Destination:
        """Return where the vessel was.

        Raises:
            RefusedError: there is nothing to pour into.
        """
        if scene.target is None:
            raise RefusedError(f"I do not know what to pour the {task.object_text or scene.moved.name} into")
        return original_place(scene.moved)

    def serves(self, grasp: Grasp) -> bool:
        """Tell whether a grasp is across and not from straight above: what is held so cannot be tilted far."""
        return grasp.family == "across" and float(grasp.approach[2]) > self.options.steepest

    def rounds(self, ordered: Sequence[tuple[ArmPlanner, Grasp]]) -> list[Sequence[tuple[ArmPlanner, Grasp]]]:
        """Return the less steep grasps, if there are any, and then all."""
        flat = [(arm, grasp) for arm, grasp in ordered if grasp.approach[2] > self.options.steep]
        return [flat, ordered] if flat else [ordered]

    def steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return the steps to the vessel, to over the target, tilting there, and back."""
        taking = taking_steps(reach)
        names = task.object_text or task.object.label or "object", task.target_text or "target"
        pour = find_pour(reach.arm, reach.grasp, reach.lift[-1], names, strict=strict, options=self.options)
        upright = replace(reach, lift=np.vstack([reach.lift[-1], pour.over[-1]]), over=None)
        back = placing_steps(upright, reach.arm.start, reach.arm.start_gap, strict=strict)
        return (*taking, *pouring_steps(reach, pour, self.options), *back)

    def expected(self, task: ManipulationTask, plan: Plan) -> tuple[ManipulationTask, Plan]:
        """Return task and plan without the target: the vessel is to stand again where it was."""
        return replace(task, target=None), replace(plan, scene=replace(plan.scene, target=None))


@dataclass(frozen=True, slots=True)
class PourPath:
    """Joint paths (N, 8) of a pour: `over` leads to above the target, `tilt` tilts there and is reversed afterwards."""

    over: FloatArray
    tilt: FloatArray


def mouth_edge(moved: ObjectShape, ahead: FloatArray) -> FloatArray:
    """Return the point (3,) of the upper edge over which is poured towards a horizontal direction (2,)."""
    radius = moved.axis.radius if moved.axis is not None else 0.5 * float(moved.size[1])
    return np.array([*(moved.middle[:2] + radius * ahead), moved.top])


def motions(
    moved: ObjectShape,
    target: ObjectShape,
    ahead: FloatArray,
    turn: float,
    tilt: float,
    options: PourOptions = POUR,
) -> FloatArray:
    """Return motions (K, 4, 4) of the object from upright to tilted [rad] over the target.

    ahead (2,) is where the upright object's mouth is to be tipped towards; turn [rad] is about the vertical before.
    """
    edge = mouth_edge(moved, ahead)
    place = np.array([*(target.rim.centre if target.rim is not None else target.middle[:2]), 0.0])
    axis = np.array([-ahead[1], ahead[0], 0.0])
    upright_turn = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
    result = []
    for angle in np.linspace(0.0, tilt, int(np.ceil(tilt / np.radians(options.step_deg))) + 1):
        motion = np.eye(4)
        motion[:3, :3] = upright_turn @ Rotation.from_rotvec(angle * axis).as_matrix()
        lowest = float(((moved.points - edge) @ motion[2, :3]).min())
        place[2] = target.top + options.over_m - min(lowest, 0.0)
        motion[:3, 3] = place - motion[:3, :3] @ edge
        result.append(motion)
    return np.array(result)


def find_pour(
    arm: ArmPlanner,
    grasp: Grasp,
    lifted: FloatArray,
    names: tuple[str, str],
    *,
    strict: bool = False,
    options: PourOptions = POUR,
) -> PourPath:
    """Return a pour with a grasp, from where the object was lifted to (8,); names: of object and target.

    Raises:
        RefusedError: there is nothing to pour into, or the arm cannot tilt there; strict, not without spilling before.
    """
    what, into = names
    moved, target = arm.scene.moved, arm.scene.target
    if target is None:
        raise RefusedError(f"I do not know what to pour the {what} into")
    carrying = arm.carry_checker(grasp, frozenset())

    def begin(direction: tuple[FloatArray, float, float]) -> list[tuple[FloatArray, FloatArray]]:
        poses = motions(moved, target, *direction, options) @ grasp.pose
        starts = arm.solver.solutions(poses[0], [lifted, arm.start], carrying, count=3, restarts=0)
        return [(q, poses) for q in starts]

    def tilt(start: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
        q, poses = start
        return q, follow_poses(arm.solver, carrying, q, poses[1:])

    def bring_upright(tilted: tuple[FloatArray, FloatArray]) -> PourPath:
        q, tilting = tilted
        return PourPath(plan_upright_motion(arm, grasp, lifted, q, strict=True), tilting)

    error, deadline_s = UnreachableError("place"), time.thread_time() + options.time_s
    reachable = (InCollisionError, UnreachableError)
    begun = Alternatives(
        _tilt_directions(grasp, options), begin, error=error, recoverable=reachable, deadline_s=deadline_s
    )
    starts = (start for found in begun for start in found)
    tilted = Alternatives(starts, tilt, error=error, recoverable=BLOCKED)
    pours = Alternatives(tilted, bring_upright, error=error, recoverable=BLOCKED)
    for pour in pours:
        return pour
    if pours.failures and not strict:  # the target can only be reached with the vessel tilted in transfer
        (q, tilting), _ = pours.failures[0]
        return PourPath(plan_upright_motion(arm, grasp, lifted, q), tilting)
    _LOG.debug("no pour: %s; %s; %s", begun.error, tilted.error, pours.error)
    raise PlanningError(f"I cannot tilt the {what} over the {into}") from tilted.error


def pouring_steps(reach: Reach, pour: PourPath, options: PourOptions = POUR) -> tuple[Step, ...]:
    """Return the steps from the lifted object to over the target, tilting there, and upright again."""
    arm, carrying = reach.arm, reach.arm.carry_checker(reach.grasp, frozenset())
    speed_scale = min(reach.carrying_speed_scale, options.transfer_speed_scale)
    return (
        move(arm, Stage.TRANSFERRING, (pour.over, carrying, speed_scale), "to over the target"),
        move(arm, Stage.TRANSFERRING, (pour.tilt, carrying, options.tilt_speed_scale), "pouring"),
        move(arm, Stage.TRANSFERRING, (pour.tilt[::-1], carrying, options.return_speed_scale), "upright again"),
    )


def _tilt_directions(grasp: Grasp, options: PourOptions) -> Iterator[tuple[FloatArray, float, float]]:
    """Yield directions to tip the mouth to (2,), turns, tilts: rolling the hand about where it points comes first."""
    flat = grasp.approach[:2]
    flat = grasp.pose[:2, 2] if np.linalg.norm(flat) < options.least_horizontal else flat / np.linalg.norm(flat)
    roll = np.array([-flat[1], flat[0]])
    for tilt in np.radians(options.tilts_deg):
        for turn in np.radians(options.turns_deg):
            for ahead in (roll, -roll):
                yield ahead, float(turn), float(tilt)
