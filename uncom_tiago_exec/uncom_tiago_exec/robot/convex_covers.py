# SPDX-License-Identifier: Apache-2.0
"""Convex solids of few corners that hold the collision meshes of a robot, for a first and quick look.

A cover is a convex body of at most CORNERS corners and a radius: every point of what it holds is within the radius of
the body. What keeps a margin and the radius from the body keeps the margin from the shape, so a cover never calls
free what is not. Shapes of many corners are held by several bodies, found once by measure_covers.py and kept in a
file under a hash of the mesh; a mesh that is not in the file gets one body, coarser and as safe.
Bodies have so few corners that coal looks at all of them to find the farthest: its search from corner to corner, for
larger bodies, is not used (coal issue 308).
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import coal
import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull, QhullError

from uncom_tiago_exec.robot.options import CONVEX_COVERS, ConvexCoverOptions
from uncom_tiago_exec.types import FloatArray

FILE = Path(__file__).parents[1] / "config" / "covers.json"
_MESHES: dict[tuple[str, bool], tuple[Cover, ...]] = {}  # made once


@dataclass(frozen=True, slots=True)
class Cover:
    """A convex body (a coal shape), how far what it holds reaches beyond it [m], and its corners (N, 3)."""

    body: Any
    radius: float
    corners: FloatArray


def convex_covers(mesh: FloatArray, *, fine: bool, options: ConvexCoverOptions = CONVEX_COVERS) -> tuple[Cover, ...]:
    """Return bodies that together hold the convex hull of a mesh's vertices (N, 3); several only if they are fine."""
    key = (name_of(mesh), fine)
    if key not in _MESHES:
        listed = _as_lists().get(key[0]) if fine else None
        if listed is None:
            listed = (fewer(convex_hull(mesh), options=options),)
        _MESHES[key] = tuple(_cover(*body) for body in listed)
    return _MESHES[key]


def name_of(mesh: FloatArray) -> str:
    """Return the name under which the file keeps a mesh's vertices (N, 3): a hash of them in hundredths of mm."""
    return hashlib.sha256(np.round(mesh * 1e5).astype(np.int64).tobytes()).hexdigest()[:24]


@lru_cache(maxsize=1)
def _as_lists() -> dict[str, tuple[tuple[FloatArray, float], ...]]:
    if not FILE.is_file():
        return {}
    meshes = json.loads(FILE.read_text(encoding="utf-8"))["meshes"]
    return {
        name: tuple((np.array(body["corners"]), float(body["radius"])) for body in bodies)
        for name, bodies in meshes.items()
    }


def shape_corners(shape: Any, *, options: ConvexCoverOptions = CONVEX_COVERS) -> FloatArray | None:
    """Return points (N, 3) whose hull holds a box, cylinder or mesh, in its own frame; None for other kinds."""
    if isinstance(shape, coal.BVHModelBase):
        return np.array(shape.vertices())
    if isinstance(shape, coal.Box):
        signs = np.array([[a, b, c] for a in (-1.0, 1.0) for b in (-1.0, 1.0) for c in (-1.0, 1.0)])
        return np.asarray(signs * np.array(shape.halfSide))
    if isinstance(shape, coal.Cylinder):
        angles = np.arange(options.prism_sides) * 2.0 * np.pi / options.prism_sides
        ring = np.column_stack([np.cos(angles), np.sin(angles)]) * (shape.radius / np.cos(np.pi / options.prism_sides))
        return np.vstack(
            [np.column_stack([ring, np.full(options.prism_sides, z)]) for z in (-shape.halfLength, shape.halfLength)]
        )
    return None


def convex_hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points (N, 3)."""
    return np.asarray(points[ConvexHull(points).vertices])


def fewer(corners: FloatArray, *, options: ConvexCoverOptions = CONVEX_COVERS) -> tuple[FloatArray, float]:
    """Return at most CORNERS of a hull's corners (N, 3), and how far the others are from their hull at most [m].

    Each time that one is taken which lies farthest beyond a face of those taken.
    """
    if len(corners) <= options.max_corners:
        return corners, 0.0
    chosen = _simplex(corners)
    hull = ConvexHull(corners[chosen], incremental=True)
    while len(chosen) < options.max_corners:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        chosen.append(int(outside.argmax()))
        try:
            hull.add_points(corners[chosen[-1:]])
        except QhullError:  # faces too nearly in one plane to be merged: shaken a little they are told apart
            hull = ConvexHull(corners[chosen], incremental=True, qhull_options="QJ")
    hull.close()
    rest = np.delete(corners, chosen, axis=0)
    return corners[chosen], max(_distance(corners[chosen], point) for point in rest) + options.slack_m


def _simplex(corners: FloatArray) -> list[int]:
    """Return four corners that are far from one plane: each is the farthest from what those before it span."""
    rest = corners - corners[0]
    chosen = [int((rest * rest).sum(axis=1).argmax())]
    rest = corners - corners[chosen[0]]
    for _ in range(3):
        chosen.append(int((rest * rest).sum(axis=1).argmax()))
        along = rest[chosen[-1]] / np.linalg.norm(rest[chosen[-1]])
        rest = rest - np.outer(rest @ along, along)
    return chosen


def _distance(corners: FloatArray, point: FloatArray) -> float:
    """Return a bound on how far a point (3,) is from the hull of corners (N, 3): its distance from one mixture."""
    weights, _ = nnls(np.vstack([corners.T, np.full(len(corners), 1e3)]), np.append(point, 1e3))
    return float(np.linalg.norm(weights @ corners / weights.sum() - point))


def _cover(corners: FloatArray, radius: float) -> Cover:
    hull = ConvexHull(corners)
    kept = corners[hull.vertices]
    place = np.zeros(len(corners), dtype=int)
    place[hull.vertices] = np.arange(len(kept))
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in kept:
        points.append(corner)
    for triangle, plane in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = (int(i) for i in place[triangle])
        if np.cross(kept[b] - kept[a], kept[c] - kept[a]) @ plane[:3] < 0.0:
            b, c = c, b
        faces.append(coal.Triangle(a, b, c))
    return Cover(coal.Convex(points, faces), radius, kept)
