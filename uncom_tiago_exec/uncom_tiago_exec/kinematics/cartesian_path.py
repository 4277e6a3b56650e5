# SPDX-License-Identifier: Apache-2.0
"""Straight motions of the hand: the pose is stepped along a line and the joints follow by continuation."""

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
    """Return `count` poses (4, 4) after `start` on the straight line to `end`, the rotation turning evenly."""
    shares = np.arange(1, count + 1) / count
    poses = np.tile(np.asarray(end, dtype=float), (count, 1, 1))
    poses[:, :3, 3] = start[:3, 3] + shares[:, None] * (end[:3, 3] - start[:3, 3])
    if np.abs(end[:3, :3] - start[:3, :3]).max() > options.turned:
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
    """Return joint positions (N, 8) that move the hand straight from configuration `start` to the pose `end` (4, 4).

    Raises:
        PlanningError: the arm reaches a limit, or would have to flip, on the way.
        InCollisionError: something is in the way.
    """
    pose = solver.group.forward(start)
    if not solver.group.within_reach(end):
        raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end")
    turn = float(np.arccos(np.clip((np.trace(pose[:3, :3].T @ end[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    count = max(1, int(np.ceil(max(float(np.linalg.norm(end[:3, 3] - pose[:3, 3])) / options.step_m, turn / 0.05))))
    return follow_poses(
        solver, checker, start, np.array(interpolate_poses(pose, end, count, options=options)), options=options
    )


def follow_poses(
    solver: IkSolver,
    checker: CollisionChecker,
    start: FloatArray,
    poses: FloatArray,
    *,
    options: CartesianPathOptions = CARTESIAN_PATH,
) -> FloatArray:
    """Return joint positions (N + 1, 8) that bring the hand from configuration `start` through poses (N, 4, 4).

    Raises:
        PlanningError: the arm reaches a limit, or would have to flip, on the way.
        InCollisionError: something is in the way.
    """
    try:
        quick = solver.along(poses, start)
    except UnreachableError as error:
        raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end") from error
    if quick is not None and _smooth(np.vstack([start, quick]), options=options):
        result = np.vstack([start, quick])
    else:
        result = _followed(solver, start, poses, options=options)
    hit = checker.first_collision(result, options.check_rad)
    if hit is not None:
        pairs = checker.touching(hit)
        text = ", ".join(f"{a} and {b}" for a, b in pairs[:2])
        raise InCollisionError(f"something is in the way of the straight line ({text})", pairs)
    return result


def _followed(
    solver: IkSolver, start: FloatArray, poses: FloatArray, *, options: CartesianPathOptions = CARTESIAN_PATH
) -> FloatArray:
    """Follow poses by descent, each from the one before, with all joints."""
    path = [np.asarray(start)]
    for pose in poses:
        q = solver.descend(pose, path[-1], iterations=15)
        if q is None:
            raise PlanningError(f"the {solver.group.side} arm cannot follow the straight line to its end")
        path.append(q)
        if not _smooth(np.array(path[-2:]), options=options):
            raise PlanningError(f"the {solver.group.side} arm would have to turn over on the straight line")
    return np.array(path)


def _smooth(path: FloatArray, *, options: CartesianPathOptions = CARTESIAN_PATH) -> bool:
    jumps = np.abs(np.diff(path, axis=0)).max(axis=0)
    return bool(jumps[1:].max() <= options.largest_jump_rad and jumps[0] <= options.largest_torso_jump_m)
