# SPDX-License-Identifier: Apache-2.0
"""Criteria for acts that the end state does not show: pouring, handing over, pointing, and what is held at the end.

An observer records the poses of objects and hands at intervals; afterwards each act is judged by this record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from uncom_sim.objects.catalogue import model
from uncom_sim.objects.footprint import outline
from uncom_sim.scoring.end_state import PhysicalResult
from uncom_sim.scoring.options import ACTS, ActCriteria
from uncom_sim.types import FloatArray, Meaning, ObjectState, SceneObject, Table
from uncom_sim.world.simulator import Simulator

HANDS = ("left", "right")
_FILLABLE_KINDS = ("mug", "cup", "bowl", "bottle", "can")


@dataclass(frozen=True, slots=True)
class Moment:
    """Where the object, the target and the grasping frames of both hands are: poses (4, 4)."""

    time_s: float
    object: FloatArray
    target: FloatArray | None
    hands: tuple[FloatArray, FloatArray]


class ActObserver:
    """Records a moment each time it is called."""

    def __init__(self, simulator: Simulator, goal: Meaning) -> None:
        """The object and the target of the goal are observed; both have to be in the scene."""
        self.moments: list[Moment] = []
        self._simulator = simulator
        self._goal = goal

    def __call__(self) -> None:
        """Record the present poses."""
        poses = {state.id: state.pose for state in self._simulator.object_states()}
        left, right = (self._simulator.robot.frame(f"gripper_{side}_grasping_frame") for side in HANDS)
        target = None if self._goal.target is None else poses[self._goal.target]
        self.moments.append(Moment(self._simulator.time_s, poses[self._goal.object], target, (left, right)))


def judge_act(
    act: str,
    result: PhysicalResult,
    moments: Sequence[Moment],
    objects: tuple[ObjectState, ObjectState | None],
    held: frozenset[str],
    table: Table,
    *,
    options: ActCriteria = ACTS,
) -> PhysicalResult:
    """Add to the judgement of the end what has to have happened on the way.

    Args:
        act: "pick", "give", "pour", "point", or anything else: then the hands have to be empty.
        result: what the end state says.
        moments: what the observer noted, in the order of time.
        objects: the object and the target as they were before.
        held: ids of what is between two fingers at the end.
        table: the table.
        options: the criteria.
    """
    obj, target = objects
    if act in ("pick", "give"):
        if obj.id not in held:
            return replace(result, success=False, reason=f"{obj.id} is not between the fingers")
        success, reason = (
            _held_out(obj, moments[-1], table, options=options) if act == "give" else (True, result.reason)
        )
    elif held:
        return replace(result, success=False, reason=f"{', '.join(sorted(held))} is still between the fingers")
    elif act == "pour" and target is not None:
        success, reason = _poured(obj, target, moments, options=options)
    elif act == "point":
        success, reason = _pointed(obj, moments, table, options=options)
    else:
        return result
    if act in ("pour", "point") and success and result.object_moved_m > options.stayed_m:
        success, reason = False, f"{reason}, but it was moved by {result.object_moved_m:.2f} m"
    if not result.success:
        return result if reason == result.reason else replace(result, reason=f"{reason}; {result.reason}")
    return replace(result, success=success, reason=reason)


def _held_out(obj: ObjectState, end: Moment, table: Table, *, options: ActCriteria = ACTS) -> tuple[bool, str]:
    """Judge whether an object hangs high over the table, ahead of the robot, and nothing runs out of it."""
    points = np.concatenate(model(obj.kind, obj.colour).hulls) @ end.object[:3, :3].T + end.object[:3, 3]
    above, ahead = float(points[:, 2].min()) - table.height, float(end.object[0, 3])
    if obj.kind in _FILLABLE_KINDS and end.object[2, 2] < options.level_cos:
        return False, f"{obj.id} is held out tilted"
    good = above > options.given_above_m and ahead > options.given_ahead_m
    return good, f"{obj.id} is held out {ahead:.2f} m ahead, {above:.2f} m above the table"


def opening_rim(obj: ObjectState) -> FloatArray:
    """Return points (24, 3) of the edge of an object's upper opening, in its body frame [m]."""
    shape = model(obj.kind, obj.colour)
    if shape.opening is not None:
        (x, y), radius, z = shape.opening.centre, shape.opening.radius, shape.opening.rim_z
    else:
        points = np.concatenate(shape.hulls)
        top = points[points[:, 2] > points[:, 2].max() - 0.003]
        (x, y), z = top[:, :2].mean(axis=0), float(top[:, 2].max())
        radius = float(np.linalg.norm(top[:, :2] - (x, y), axis=1).max())
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles), np.full(24, z)])


def _poured(
    obj: ObjectState, target: ObjectState, moments: Sequence[Moment], *, options: ActCriteria = ACTS
) -> tuple[bool, str]:
    """Judge whether the mouth was tipped over the opening of the target for long enough, and never beside it."""
    opening = model(target.kind, target.colour).opening
    if opening is None:
        return False, f"nothing can be poured into {target.id}"
    edge, poured, steepest = opening_rim(obj), 0.0, 0.0
    before = moments[0].time_s
    for moment in moments:
        tilt = float(np.arccos(np.clip(moment.object[2, 2], -1.0, 1.0)))
        steepest = max(steepest, tilt)
        span, before = moment.time_s - before, moment.time_s
        if tilt < options.spilling_tilt_rad or moment.target is None:
            continue
        ring = edge @ moment.object[:3, :3].T + moment.object[:3, 3]
        lowest = (ring[ring[:, 2].argmin()] - moment.target[:3, 3]) @ moment.target[:3, :3]
        away = float(np.hypot(lowest[0] - opening.centre[0], lowest[1] - opening.centre[1]))
        if away > opening.radius or lowest[2] < opening.rim_z:
            return False, f"{obj.id} was tilted by {np.degrees(tilt):.0f} degrees {away:.2f} m off {target.id}"
        poured += span if tilt > options.pouring_tilt_rad else 0.0
    text = f"{obj.id} was tilted by {np.degrees(steepest):.0f} degrees over {target.id}, poured for {poured:.1f} s"
    return poured >= options.poured_s, text


def _pointed(
    obj: ObjectState, moments: Sequence[Moment], table: Table, *, options: ActCriteria = ACTS
) -> tuple[bool, str]:
    """Judge whether the line of a hand's fingers met the object, from near, at some moment."""
    corners = np.concatenate(model(obj.kind, obj.colour).hulls) @ obj.pose[:3, :3].T + obj.pose[:3, 3]
    low, high = table.height, float(corners[:, 2].max())
    yaw = float(np.arctan2(obj.pose[1, 0], obj.pose[0, 0]))
    x, y = map(float, obj.position[:2])
    shape = outline(SceneObject(obj.id, obj.kind, obj.colour, x, y, yaw))
    best = np.inf
    along = np.arange(options.tip_m, options.pointed_from_m + options.tip_m, 0.01)
    for moment in moments:
        for hand in moment.hands:
            line = hand[:3, 3] + along[:, None] * hand[:3, 0]
            beyond = np.maximum(np.maximum(low - line[:, 2], line[:, 2] - high), 0.0)
            gaps = shapely.distance(shape, shapely.points(line[:, :2]))
            best = min(best, float(np.hypot(beyond, gaps).min()))
    return best < options.pointed_m, f"the line of the fingers passed {obj.id} at {best:.2f} m"
