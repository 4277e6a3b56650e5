# SPDX-License-Identifier: Apache-2.0
"""Straight motions of the hand: poses are interpolated along a line, and the joints follow them continuously."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, UnreachableError
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.kinematics.options import CARTESIAN_PATH, CartesianPathOptions
from uncom_tiago_exec.types import FloatArray


def interpolate_poses(
    start: FloatArray, end: FloatArray, count: int, *, options: CartesianPathOptions = CARTESIAN_PATH
) -> list[FloatArray]:
    """Return `count` poses (4, 4) from after `start` up to `end`, both (4, 4).

    Positions lie on the straight line, rotations turn at constant speed about one axis (slerp: Shoemake 1985).
    """
    shares = np.arange(1, count + 1) / count
    poses = np.tile(np.asarray(end, dtype=float), (count, 1, 1))
    poses[:, :3, 3] = start[:3, 3] + shares[:, None] * (end[:3, 3] - start[:3, 3])
    if np.abs(end[:3, :3] - start[:3, :3]).max() > options.same_rotation:
        ends = Rotation.from_matrix(np.stack([start[:3, :3], end[:3, :3]]))
        poses[:, :3, :3] = Slerp([0.0, 1.0], ends)(shares).as_matrix()
    return list(poses)


def straight_path(
    solver: IkSolver,
    checker: CollisionChecker,
    start: FloatArray,
    end: FloatArray,
    *,
    options: CartesianPathOptions = CARTESIAN_PATH,
) -> FloatArray:
    """Return configurations (N, 8) that move the hand along the straight line to a pose.

    Args:
        solver: of the arm that moves.
        checker: every configuration has to be free according to it.
        start: configuration (8,), the first of the path.
        end: pose of the grasping frame in base_footprint (4, 4).
        options: numbers that tune it.

    Raises:
        PlanningError: the arm reaches a joint limit, or would have to change its posture, on the way.
        InCollisionError: an obstacle is in the way.
    """
    pose = solver.group.forward(start)
    if not solver.group.within_reach(end):
        raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end")
    turn = float(np.arccos(np.clip((np.trace(pose[:3, :3].T @ end[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    length = float(np.linalg.norm(end[:3, 3] - pose[:3, 3]))
    count = max(1, int(np.ceil(max(length / options.step_m, turn / options.turn_step_rad))))
    poses = np.array(interpolate_poses(pose, end, count, options=options))
    return follow_poses(solver, checker, start, poses, options=options)


def follow_poses(
    solver: IkSolver,
    checker: CollisionChecker,
    start: FloatArray,
    poses: FloatArray,
    *,
    options: CartesianPathOptions = CARTESIAN_PATH,
) -> FloatArray:
    """Return configurations (N + 1, 8) that take the hand through poses.

    Args:
        solver: of the arm that moves.
        checker: every configuration has to be free according to it.
        start: configuration (8,), the first of the path.
        poses: of the grasping frame in base_footprint (N, 4, 4), close to one another.
        options: numbers that tune it.

    Raises:
        PlanningError: the arm reaches a joint limit, or would have to change its posture, on the way.
        InCollisionError: an obstacle is in the way.
    """
    try:
        tracked = solver.track_poses(poses, start)
    except UnreachableError as error:
        raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end") from error
    if tracked is not None and _is_continuous(np.vstack([start, tracked]), options=options):
        result = np.vstack([start, tracked])
    else:
        result = _follow_numerically(solver, start, poses, options=options)
    hit = checker.first_collision(result, options.check_rad)
    if hit is not None:
        pairs = checker.touching(hit)
        text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
        raise InCollisionError(f"something is in the way of the straight line ({text})", pairs)
    return result


def _follow_numerically(
    solver: IkSolver, start: FloatArray, poses: FloatArray, *, options: CartesianPathOptions = CARTESIAN_PATH
) -> FloatArray:
    """Follow poses (N, 4, 4) with all joints, each solved numerically from the configuration before; (N + 1, 8)."""
    path = [np.asarray(start)]
    for pose in poses:
        q = solver.solve_numerically(pose, path[-1], iterations=options.iterations)
        if q is None:
            raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end")
        path.append(q)
        if not _is_continuous(np.array(path[-2:]), options=options):
            raise PlanningError(f"the {solver.group.side} arm would have to turn over on the straight line")
    return np.array(path)


def _is_continuous(path: FloatArray, *, options: CartesianPathOptions = CARTESIAN_PATH) -> bool:
    """Tell whether no joint jumps between two configurations of a path (N, 8)."""
    jumps = np.abs(np.diff(path, axis=0)).max(axis=0)
    return bool(jumps[1:].max() <= options.largest_jump_rad and jumps[0] <= options.largest_torso_jump_m)
