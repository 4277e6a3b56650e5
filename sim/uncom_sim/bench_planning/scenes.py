# SPDX-License-Identifier: Apache-2.0
"""Cluttered tables for the planning benchmark: objects as clouds of visible points, and as solids."""

from __future__ import annotations

import numpy as np
from uncom_common.primitive import Primitive
from uncom_perception.types import Box, Detection, Geometry, TableSurface
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Obstacle

from uncom_sim.bench_planning.options import PROBLEMS, ProblemOptions

TABLE_Z = 0.72
_CAMERA = np.array([0.24, 0.02, 1.31])


def tabletop_solids(rng: np.random.Generator, count: int) -> tuple[Obstacle, ...]:
    """Return the table and `count` boxes and cylinders that stand on it, apart from one another."""
    table = Obstacle("table", "box", (0.56, 1.06, 0.08), make_upright_pose(np.array([0.7, 0.0, TABLE_Z - 0.04]), 0.0))
    solids = [table]
    for i, (x, y) in enumerate(_places(rng, count)):
        height = float(rng.uniform(0.06, 0.22))
        size = (float(rng.uniform(0.05, 0.12)), float(rng.uniform(0.05, 0.08)), height)
        pose = make_upright_pose(np.array([x, y, TABLE_Z + height / 2.0]), float(rng.uniform(-np.pi, np.pi)))
        if i % 2:
            solids.append(Obstacle(f"thing{i}", "cylinder", (size[1], size[1], height), pose))
        else:
            solids.append(Obstacle(f"thing{i}", "box", size, pose))
    return tuple(solids)


def _places(
    rng: np.random.Generator, count: int, taken: list[tuple[float, float]] | None = None
) -> list[tuple[float, float]]:
    """Return places (x, y) at least 15 cm from one another; fewer if they find no room."""
    found = list(taken or [])
    first = len(found)
    for _ in range(400 * max(count, 1)):
        if len(found) - first >= count:
            break
        x, y = float(rng.uniform(0.5, 0.9)), float(rng.uniform(-0.45, 0.45))
        if all(np.hypot(x - a, y - b) > PROBLEMS.place_gap_m for a, b in found):
            found.append((x, y))
    return found[first:]


def pick_and_place(
    rng: np.random.Generator, count: int, side: float, *, options: ProblemOptions = PROBLEMS
) -> ManipulationTask:
    """Return a task in clutter: an object within one arm's reach, to a bowl or to a free place on the same side."""
    obj = (float(rng.uniform(*options.near_x_m)), side * float(rng.uniform(0.0, 0.35)))
    while True:
        goal = (float(rng.uniform(*options.near_x_m)), side * float(rng.uniform(0.0, 0.35)))
        if np.hypot(goal[0] - obj[0], goal[1] - obj[1]) > options.least_move_m:
            break
    into = bool(rng.random() < options.into_share)
    seen = [detection("ball", _ball(*obj, float(rng.uniform(0.025, 0.036)), rng, options=options))]
    if into:
        seen.append(detection("bowl", _bowl(*goal, rng, options=options)))
    for i, (x, y) in enumerate(_places(rng, count - len(seen), [obj, goal])):
        seen.append(
            detection(f"thing{i}", _box(x, y, rng, options=options) if i % 2 else _cylinder(x, y, rng, options=options))
        )
    pose = None if into else make_upright_pose(np.array([*goal, TABLE_Z]), 0.0)
    return ManipulationTask(
        "bench",
        0,
        Primitive.PUT_IN if into else Primitive.PLACE,
        "in" if into else "none",
        seen[0],
        tuple(seen),
        flat_table(),
        seen[1] if into else None,
        pose,
        "ball",
        "bowl" if into else "",
    )


def flat_table() -> TableSurface:
    """Return a table of half a metre by one as it is seen, in the base frame."""
    corners = np.array([[0.45, -0.5], [0.95, -0.5], [0.95, 0.5], [0.45, 0.5]])
    polygon = np.column_stack([corners, np.full(4, TABLE_Z)])
    return TableSurface(polygon, np.array([0.0, 0.0, 1.0]), np.zeros((0, 2)))


def detection(name: str, cloud: FloatArray) -> Detection:
    """Return an object of which the points (N, 3) [m] are known and no picture."""
    pose = np.eye(4)
    pose[:3, 3] = cloud.mean(axis=0)
    geometry = Geometry(cloud.mean(axis=0), pose, np.ptp(cloud, axis=0), cloud.astype(np.float32))
    return Detection(name, name, 1.0, Box(0.0, 0.0, 1.0, 1.0), np.zeros((1, 1), dtype=bool), geometry)


def _seen(points: FloatArray, normals: FloatArray, pose: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Place a surface and keep what faces the camera, with 1 mm of noise."""
    world = points @ pose[:3, :3].T + pose[:3, 3]
    facing = ((_CAMERA - world) * (normals @ pose[:3, :3].T)).sum(axis=1) > 0.0
    return np.asarray(world[facing] + rng.normal(scale=0.001, size=(int(facing.sum()), 3)))


def _ball(
    x: float, y: float, radius: float, rng: np.random.Generator, *, options: ProblemOptions = PROBLEMS
) -> FloatArray:
    normals = rng.normal(size=(options.points, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return _seen(normals * radius, normals, make_upright_pose(np.array([x, y, TABLE_Z + radius]), 0.0), rng)


def _cylinder(x: float, y: float, rng: np.random.Generator, *, options: ProblemOptions = PROBLEMS) -> FloatArray:
    radius, height = float(rng.uniform(0.028, 0.04)), float(rng.uniform(0.08, 0.2))
    angle, share = rng.uniform(-np.pi, np.pi, options.points), np.sqrt(rng.uniform(0.0, 1.0, options.points))
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(options.points)])
    wall = ring * radius + np.column_stack([np.zeros((options.points, 2)), rng.uniform(0.0, height, options.points)])
    top = ring * (radius * share)[:, None] + [0.0, 0.0, height]
    normals = np.vstack([ring, np.tile([0.0, 0.0, 1.0], (options.points, 1))])
    return _seen(np.vstack([wall, top]), normals, make_upright_pose(np.array([x, y, TABLE_Z]), 0.0), rng)


def _box(x: float, y: float, rng: np.random.Generator, *, options: ProblemOptions = PROBLEMS) -> FloatArray:
    size = rng.uniform([0.06, 0.04, 0.05], [0.12, 0.07, 0.18])
    points = rng.uniform(-0.5, 0.5, (options.points * 2, 3)) * size
    faces = rng.integers(0, 6, len(points))
    normals = np.zeros_like(points)
    rows = np.arange(len(points))
    sign = np.where(faces % 2 == 0, 1.0, -1.0)
    normals[rows, faces // 2] = sign
    points[rows, faces // 2] = 0.5 * sign * size[faces // 2]
    pose = make_upright_pose(np.array([x, y, TABLE_Z + size[2] / 2.0]), float(rng.uniform(-np.pi, np.pi)))
    return _seen(points, normals, pose, rng)


def _bowl(x: float, y: float, rng: np.random.Generator, *, options: ProblemOptions = PROBLEMS) -> FloatArray:
    """Return inside and outside of a widening bowl and its floor."""
    radius, height = float(rng.uniform(0.075, 0.095)), 0.065
    t, angle = rng.uniform(0.0, 1.0, options.points), rng.uniform(-np.pi, np.pi, options.points)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points, normals = [], []
    for inset, sign in ((0.0, 1.0), (0.004, -1.0)):
        r = radius * (0.5 + 0.5 * t) - inset
        points.append(np.column_stack([ring * r[:, None], 0.005 + (height - 0.005) * t]))
        normals.append(np.column_stack([sign * ring * 0.8, np.full(options.points, -0.6 * sign)]))
    floor = radius * 0.5 * np.sqrt(rng.uniform(0.0, 1.0, options.points))
    points.append(np.column_stack([ring * floor[:, None], np.full(options.points, 0.006)]))
    normals.append(np.tile([0.0, 0.0, 1.0], (options.points, 1)))
    return _seen(np.vstack(points), np.vstack(normals), make_upright_pose(np.array([x, y, TABLE_Z]), 0.0), rng)
