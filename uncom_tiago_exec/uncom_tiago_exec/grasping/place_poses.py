# SPDX-License-Identifier: Apache-2.0
"""Where a held object is released: on an area of the table, in an opening, or on top of another object.

The result is hand poses: the object is turned about the vertical and tilted in steps, keeping its grasp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.options import PLACE_POSES, PlacePoseOptions
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.obstacles import TABLE, is_on_table, is_shallow
from uncom_tiago_exec.types import FloatArray, ManipulationTask


@dataclass(frozen=True, slots=True)
class Place:
    """A way to release an object.

    Attributes:
        hand: pose of the grasping frame in base_footprint (4, 4).
        motion: of the object in base_footprint (4, 4), from where it was grasped to its place.
        touches: names of obstacles that the object may touch there.
    """

    hand: FloatArray
    motion: FloatArray
    touches: frozenset[str]


@dataclass(frozen=True, slots=True)
class Destination:
    """Where an object is to end.

    Attributes:
        xy: place of the centre of its footprint in base_footprint (2,) [m].
        bottom: height of its bottom at the release [m].
        touches: names of obstacles that it may touch there.
        into: shape of the hollow object that it goes into, or None.
        tolerance_m: distance from xy at which it may also be put [m].
    """

    xy: FloatArray
    bottom: float
    touches: frozenset[str]
    into: ObjectShape | None = None
    tolerance_m: float = 0.0


def destination(
    task: ManipulationTask,
    moved: ObjectShape,
    target: ObjectShape | None,
    *,
    into: bool = False,
    onto: bool = False,
    options: PlacePoseOptions = PLACE_POSES,
) -> Destination:
    """Return where the object to move of a task is to end.

    Args:
        task: with the relation to the target and the place on the table.
        moved: object to move.
        target: object that receives it, or None.
        into: whether it goes into the target, whatever the relation of the task.
        onto: whether it goes on top of the target, whatever the relation of the task.
        options: numbers that tune it.

    Raises:
        RefusedError: no place is given, it is off the table, or the object does not fit.
    """
    what = task.object_text or moved.name
    if target is not None and (into or task.relation == "in"):
        return _inside(moved, target, what, options=options)
    if target is not None and (onto or task.relation == "on"):
        return _on_top(moved, target, options=options)
    if task.target_pose is None or task.table is None:
        raise RefusedError(f"I do not know where to put the {what}")
    xy = np.asarray(task.target_pose[:2, 3], dtype=float)
    if not is_on_table(task.table, xy, options.table_margin_m):
        raise RefusedError(f"the place for the {what} is not on the table")
    return Destination(xy, task.table.height_m + options.release_gap_m, frozenset({TABLE}))


def original_place(moved: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> Destination:
    """Return the destination of an object that is put back where it was."""
    return Destination(moved.middle[:2], moved.bottom + options.release_gap_m, frozenset({TABLE}))


def _inside(
    moved: ObjectShape, target: ObjectShape, what: str, *, options: PlacePoseOptions = PLACE_POSES
) -> Destination:
    """Return the destination in a hollow object, on top of another one; `what` is what the person called the object.

    Raises:
        RefusedError: it is wider than the opening.
    """
    rim = target.rim
    if rim is None:
        return _on_top(moved, target, options=options)
    if float(moved.size[1]) > 2.0 * rim.radius:
        raise RefusedError(f"the {what} is too wide for the {target.name}")
    return Destination(rim.centre, rim.floor_z + options.floor_gap_m, frozenset({target.name, TABLE}), target)


def _on_top(moved: ObjectShape, target: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> Destination:
    """Return the destination on the surface that bears the object: the floor of a shallow dish, or the top."""
    touches = frozenset({target.name, TABLE})
    if target.rim is not None and is_shallow(target.rim):
        if float(moved.size[0]) < options.flat_dish_radii * target.rim.radius:
            tolerance_m = options.flat_floor_share * target.rim.radius - 0.5 * float(moved.size[0])
            height = target.rim.floor_z + options.floor_gap_m
            return Destination(target.rim.centre, height, touches, tolerance_m=max(tolerance_m, 0.0))
        return Destination(target.rim.centre, target.rim.z + options.release_gap_m, touches)
    return Destination(target.middle[:2], target.top + options.release_gap_m, touches)


def place_candidates(
    goal: Destination,
    moved: ObjectShape,
    grasp: Grasp,
    gripper: GripperShape,
    *,
    coarse: bool = False,
    options: PlacePoseOptions = PLACE_POSES,
) -> list[Place]:
    """Return ways to release an object at its destination, the least turned and tilted first.

    Only an object that falls into an opening, or rolls anyway, may be tilted: a hand that points down less steeply
    reaches farther.

    Args:
        goal: its destination.
        moved: shape of the object where it was grasped.
        grasp: by which it is held.
        gripper: its dimensions.
        coarse: whether to try fewer turns.
        options: numbers that tune it.
    """
    flattest, tallest = options.ball_proportions
    is_ball = (
        moved.axis is not None and moved.rim is None and flattest < moved.height / (2.0 * moved.axis.radius) < tallest
    )
    pitch = float(np.arcsin(np.clip(-grasp.approach[2], -1.0, 1.0)))
    tilts = [t for t in options.tilts_rad if t == 0.0 or goal.into is not None or is_ball]
    if _is_long(goal, moved, options=options):
        tilts = [*options.leaning_rad, *options.tilts_rad]
    found: list[Place] = []
    for tilt in tilts:
        if pitch - tilt < options.least_pitch_rad:
            continue
        found += [
            _place_pose(goal, moved, grasp, gripper, float(turn), float(tilt), options=options)
            for turn in (options.coarse_turns_rad if coarse else options.turns_rad)
        ]
    if goal.tolerance_m > options.least_tolerance_m:  # nearer to the robot is easier to reach
        share = goal.tolerance_m / float(np.linalg.norm(goal.xy))
        nearer = replace(goal, xy=goal.xy * (1.0 - share), tolerance_m=0.0)
        found += place_candidates(nearer, moved, grasp, gripper, coarse=coarse, options=options)
    return found


def _place_pose(
    goal: Destination,
    moved: ObjectShape,
    grasp: Grasp,
    gripper: GripperShape,
    turn: float,
    tilt: float,
    *,
    options: PlacePoseOptions = PLACE_POSES,
) -> Place:
    """Return the release with the object turned and tilted about its middle [rad], and at the right height.

    The visible points of the object end a little above what it stands on; the hand would come lower by as much as that
    than it was at the grasp.
    """
    closing = grasp.pose[:3, 1]
    rotation = Rotation.from_rotvec([0.0, 0.0, turn]) * Rotation.from_rotvec(-tilt * closing)
    motion = np.eye(4)
    motion[:3, :3] = rotation.as_matrix()
    motion[:3, 3] = -motion[:3, :3] @ moved.middle
    unseen = max(0.0, float(moved.points[:, 2].min()) - moved.bottom)
    low = float((moved.points @ motion[2, :3] + motion[2, 3]).min()) - unseen
    hand = motion @ grasp.pose
    bottom, xy = goal.bottom, goal.xy
    if goal.into is not None:
        leaning = _is_long(goal, moved, options=options) and tilt > 0.0
        radius = goal.into.rim.radius if goal.into.rim is not None else np.inf
        fits = leaning or 0.5 * float(moved.size[0]) < radius - options.fit_gap_m
        bottom = _release_height(goal.into, hand, low, gripper, goal.bottom if fits else -np.inf, options=options)
        if leaning:
            xy, above_rim = _low_end_inside(goal.into, moved, motion, options=options)
            bottom = max(bottom, above_rim)
    motion[:3, 3] += [xy[0], xy[1], bottom - low]
    return Place(motion @ grasp.pose, motion, goal.touches)


def _is_long(goal: Destination, moved: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> bool:
    """Tell whether an object is longer than the opening that it goes into is wide."""
    return (
        goal.into is not None
        and goal.into.rim is not None
        and moved.size[0] > options.long_radii * goal.into.rim.radius
    )


def _low_end_inside(
    target: ObjectShape, moved: ObjectShape, motion: FloatArray, *, options: PlacePoseOptions = PLACE_POSES
) -> tuple[FloatArray, float]:
    """Return how a tilted object leans over a rim with its low end inside.

    Args:
        target: hollow object.
        moved: shape of the object.
        motion: rotation of the object, about its middle (4, 4).
        options: numbers that tune it.

    Returns:
        Place of its middle (2,) in base_footprint [m], and the least height of its lowest point [m].
    """
    rim = target.rim
    if rim is None:
        return target.middle[:2], target.top
    points = moved.points @ motion[:3, :3].T + motion[:3, 3]
    end = points[points[:, 2].argmin()]
    direction = end[:2] / max(float(np.linalg.norm(end[:2])), 1e-6)
    xy = rim.centre + options.low_end_radii * rim.radius * direction - end[:2]
    outside = np.linalg.norm(points[:, :2] + xy - rim.centre, axis=1) > rim.radius - options.rim_width_m
    return xy, rim.z + options.rim_gap_m - float((points[outside, 2] - end[2]).min()) if outside.any() else -np.inf


def _release_height(
    target: ObjectShape,
    hand: FloatArray,
    low: float,
    gripper: GripperShape,
    floor: float,
    *,
    options: PlacePoseOptions = PLACE_POSES,
) -> float:
    """Return the height of the object's bottom [m] at which the fingers stay clear of a rim, as low as that allows.

    Args:
        target: hollow object.
        hand: pose of the grasping frame (4, 4), before the motion to this height.
        low: height of the object's lowest point in that pose [m].
        gripper: its dimensions.
        floor: least height of an object that fits into the opening [m]; -inf for others, which are released above the
            rim.
        options: numbers that tune it.
    """
    if target.rim is None:
        return target.top + options.release_gap_m
    pitch = float(np.arcsin(np.clip(-hand[2, 0], -1.0, 1.0)))
    tips = float(hand[2, 3] + gripper.tip * hand[2, 0]) - gripper.half_width * float(np.cos(pitch))
    lowest = floor if np.isfinite(floor) else target.rim.z + options.release_gap_m
    return max(lowest, target.rim.z + options.finger_gap_m - (tips - low))
