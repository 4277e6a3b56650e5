# SPDX-License-Identifier: Apache-2.0
"""Where a held object is let go: on an area, in an opening, on top of something."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from uncom_tiago_exec.exceptions import RefusedError
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.options import PLACE_POSES, PlacePoseOptions
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.obstacles import TABLE, is_shallow, on_table
from uncom_tiago_exec.types import FloatArray, ManipulationTask


@dataclass(frozen=True, slots=True)
class Place:
    """A way to let go: hand pose (4, 4), how the object moved (4, 4), and what it may touch there."""

    hand: FloatArray
    motion: FloatArray
    touches: frozenset[str]


@dataclass(frozen=True, slots=True)
class Destination:
    """Where the footprint's centre goes (2,), the height of its bottom, what it may touch, and the target's shape."""

    xy: FloatArray
    bottom: float
    touches: frozenset[str]
    into: ObjectShape | None = None
    room: float = 0.0  # how far from xy it may also be put [m]


def destination(
    task: ManipulationTask,
    moved: ObjectShape,
    target: ObjectShape | None,
    *,
    into: bool = False,
    onto: bool = False,
    options: PlacePoseOptions = PLACE_POSES,
) -> Destination:
    """Work out where the moved object of a task is to end.

    Args:
        options: numbers that tune it.
        task: with the target's relation and the place on the table.
        moved: the object to move.
        target: the object that receives it, or None.
        into: it goes into the target, whatever the relation says.
        onto: it goes on top of the target, whatever the relation says.

    Raises:
        RefusedError: there is no place, it is off the table, or the object cannot go there.
    """
    what = task.object_text or moved.name
    if target is not None and (into or task.relation == "in"):
        return _inside(moved, target, what, options=options)
    if target is not None and (onto or task.relation == "on"):
        return _on_top(moved, target, options=options)
    if task.target_pose is None or task.table is None:
        raise RefusedError(f"I do not know where to put the {what}")
    xy = np.asarray(task.target_pose[:2, 3], dtype=float)
    if not on_table(task.table, xy, 0.02):
        raise RefusedError(f"the place for the {what} is not on the table")
    return Destination(xy, task.table.height_m + options.release_gap_m, frozenset({TABLE}))


def original_place(moved: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> Destination:
    """Return the destination of what is to stand again where it was."""
    return Destination(moved.middle[:2], moved.bottom + options.release_gap_m, frozenset({TABLE}))


def _inside(
    moved: ObjectShape, target: ObjectShape, what: str, *, options: PlacePoseOptions = PLACE_POSES
) -> Destination:
    rim = target.rim
    if rim is None:
        return _on_top(moved, target, options=options)
    if float(moved.size[1]) > 2.0 * rim.radius:
        raise RefusedError(f"the {what} is too wide for the {target.name}")
    return Destination(rim.centre, rim.floor_z + 0.006, frozenset({target.name, TABLE}), target)


def _on_top(moved: ObjectShape, target: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> Destination:
    """Find the surface that the object will rest on: the floor of a flat dish, or the top."""
    touches = frozenset({target.name, TABLE})
    if target.rim is not None and is_shallow(target.rim):
        if float(moved.size[0]) < 1.6 * target.rim.radius:
            room = 0.6 * target.rim.radius - 0.5 * float(moved.size[0])
            return Destination(target.rim.centre, target.rim.floor_z + 0.006, touches, room=max(room, 0.0))
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
    """Return hand poses that bring the object there, turned about the vertical and tilted, least first.

    Only what falls into an opening, or is a ball, may be tilted; a hand that is less steep reaches further.
    """
    flattest, tallest = options.ball_proportions
    ball = (
        moved.axis is not None and moved.rim is None and flattest < moved.height / (2.0 * moved.axis.radius) < tallest
    )
    steep = float(np.arcsin(np.clip(-grasp.approach[2], -1.0, 1.0)))
    tilts = [t for t in options.tilts_rad if t == 0.0 or goal.into is not None or ball]
    if _is_long(goal, moved, options=options):
        tilts = [*options.leaning_rad, *options.tilts_rad]
    found: list[Place] = []
    for tilt in tilts:
        if steep - tilt < np.radians(34.0):
            continue
        found += [
            _place_pose(goal, moved, grasp, gripper, float(turn), float(tilt), options=options)
            for turn in (options.coarse_turns_rad if coarse else options.turns_rad)
        ]
    if goal.room > options.least_room_m:  # nearer to the robot is easier to reach
        nearer = replace(goal, xy=goal.xy * (1.0 - goal.room / float(np.linalg.norm(goal.xy))), room=0.0)
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
    """Turn and tilt the object about its middle, and bring its lowest point to the height of release.

    What is seen of it ends a little above what it stands on: by as much the hand would come lower than it took hold.
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
        fits = leaning or 0.5 * float(moved.size[0]) < _radius(goal.into) - 0.015
        bottom = _release_height(goal.into, hand, low, gripper, goal.bottom if fits else -np.inf, options=options)
        if leaning:
            xy, over = _one_end_in(goal.into, moved, motion, options=options)
            bottom = max(bottom, over)
    motion[:3, 3] += [xy[0], xy[1], bottom - low]
    return Place(motion @ grasp.pose, motion, goal.touches)


def _is_long(goal: Destination, moved: ObjectShape, *, options: PlacePoseOptions = PLACE_POSES) -> bool:
    """Tell whether an object would lie across the opening it is to go into."""
    return (
        goal.into is not None
        and goal.into.rim is not None
        and moved.size[0] > options.long_radii * goal.into.rim.radius
    )


def _radius(target: ObjectShape) -> float:
    return target.rim.radius if target.rim is not None else np.inf


def _one_end_in(
    target: ObjectShape, moved: ObjectShape, motion: FloatArray, *, options: PlacePoseOptions = PLACE_POSES
) -> tuple[FloatArray, float]:
    """Return where a tilted object's middle goes (2,) so that its low end is inside, and how low that may be [m]."""
    rim = target.rim
    if rim is None:
        return target.middle[:2], target.top
    points = moved.points @ motion[:3, :3].T + motion[:3, 3]
    end = points[points[:, 2].argmin()]
    ahead = end[:2] / max(float(np.linalg.norm(end[:2])), 1e-6)
    xy = rim.centre + options.low_end_radii * rim.radius * ahead - end[:2]
    outside = np.linalg.norm(points[:, :2] + xy - rim.centre, axis=1) > rim.radius - 0.012
    return xy, rim.z + 0.004 - float((points[outside, 2] - end[2]).min()) if outside.any() else -np.inf


def _release_height(
    target: ObjectShape,
    hand: FloatArray,
    low: float,
    gripper: GripperShape,
    floor: float,
    *,
    options: PlacePoseOptions = PLACE_POSES,
) -> float:
    """Return the bottom height at which fingers stay clear of the rim, as low as that allows.

    floor is how low what fits into the opening may come; what does not is released over the rim.
    """
    if target.rim is None:
        return target.top + options.release_gap_m
    pitch = float(np.arcsin(np.clip(-hand[2, 0], -1.0, 1.0)))
    tips = float(hand[2, 3] + gripper.tip * hand[2, 0]) - gripper.half_width * float(np.cos(pitch))
    lowest = floor if np.isfinite(floor) else target.rim.z + options.release_gap_m
    return max(lowest, target.rim.z + 0.014 - (tips - low))
