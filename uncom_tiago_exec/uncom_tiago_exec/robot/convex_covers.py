# SPDX-License-Identifier: Apache-2.0
r"""Convex bodies with few corners that cover the collision meshes of the robot, for fast conservative checks.

A cover is a convex body B with a radius r such that every point of the mesh M that it covers is within r of B. If an
obstacle O keeps the margin m + r from B it keeps m from M:

$$d(M, O) \ge d(B, O) - r,$$

so a check with covers never accepts a configuration that the meshes would reject. The radius is found at the corners
of the hull alone, as the distance to a convex set is a convex function and has its greatest value over a polytope at a
corner. Meshes with many corners are covered by several bodies, found once by measure_covers.py and stored in a file
under a hash of the mesh; a mesh that is not in the file gets one coarser body, which is as safe.

The bodies have so few corners that coal looks at all of them to find a support point: its hill climbing from corner
to corner, used for larger bodies, misses contacts (coal issue 308).
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

COVERS_FILE = Path(__file__).parents[1] / "config" / "covers.json"
_COVERS_BY_MESH: dict[tuple[str, bool], tuple[Cover, ...]] = {}  # each mesh is covered once a process


@dataclass(frozen=True, slots=True)
class Cover:
    """A convex body that covers a mesh or a part of one.

    Attributes:
        body: its coal shape.
        radius: greatest distance of a covered point from the body [m].
        corners: of the body (N, 3), in the frame of the mesh [m].
    """

    body: Any
    radius: float
    corners: FloatArray


def convex_covers(
    mesh: FloatArray, *, detailed: bool, options: ConvexCoverOptions = CONVEX_COVERS
) -> tuple[Cover, ...]:
    """Return bodies that together cover the convex hull of a mesh's vertices (N, 3) [m].

    Args:
        mesh: its vertices.
        detailed: whether to take the bodies in the file, if it has some; otherwise there is one coarse body.
        options: numbers that tune it.
    """
    key = (mesh_hash(mesh), detailed)
    if key not in _COVERS_BY_MESH:
        bodies = _load_bodies().get(key[0]) if detailed else None
        if bodies is None:
            bodies = (reduce_corners(convex_hull(mesh), options=options),)
        _COVERS_BY_MESH[key] = tuple(_make_cover(*body) for body in bodies)
    return _COVERS_BY_MESH[key]


def mesh_hash(mesh: FloatArray) -> str:
    """Return the key of a mesh's vertices (N, 3) [m] in the file: a hash of them in hundredths of a millimetre."""
    return hashlib.sha256(np.round(mesh * 1e5).astype(np.int64).tobytes()).hexdigest()[:24]


@lru_cache(maxsize=1)
def _load_bodies() -> dict[str, tuple[tuple[FloatArray, float], ...]]:
    """Return the bodies in the file (corners (N, 3) and radius [m]), by the hash of the mesh; none without a file."""
    if not COVERS_FILE.is_file():
        return {}
    meshes = json.loads(COVERS_FILE.read_text(encoding="utf-8"))["meshes"]
    return {
        name: tuple((np.array(body["corners"]), float(body["radius"])) for body in bodies)
        for name, bodies in meshes.items()
    }


def shape_corners(shape: Any, *, options: ConvexCoverOptions = CONVEX_COVERS) -> FloatArray | None:
    """Return points (N, 3) whose convex hull encloses a box, cylinder or mesh, in the frame of the shape [m].

    A cylinder is enclosed by a prism around it. None for other kinds of shapes.
    """
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
    """Return the corners (M, 3) of the convex hull of points (N, 3)."""
    return np.asarray(points[ConvexHull(points).vertices])


def reduce_corners(corners: FloatArray, *, options: ConvexCoverOptions = CONVEX_COVERS) -> tuple[FloatArray, float]:
    """Return at most `max_corners` of a hull's corners (N, 3), and the distance of the others from their hull [m].

    Corners are chosen greedily: from a simplex on, each next one is that farthest beyond a face of the hull so far.
    """
    if len(corners) <= options.max_corners:
        return corners, 0.0
    chosen = _initial_simplex(corners)
    hull = ConvexHull(corners[chosen], incremental=True)
    while len(chosen) < options.max_corners:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        chosen.append(int(outside.argmax()))
        try:
            hull.add_points(corners[chosen[-1:]])
        except QhullError:  # nearly coplanar faces cannot be merged: Qhull's joggled input (QJ) tells them apart
            hull = ConvexHull(corners[chosen], incremental=True, qhull_options="QJ")
    hull.close()
    rest = np.delete(corners, chosen, axis=0)
    return corners[chosen], max(_distance_bound(corners[chosen], point) for point in rest) + options.slack_m


def _initial_simplex(corners: FloatArray) -> list[int]:
    """Return the indices of four corners that are far from coplanar: each is farthest from the span of those before."""
    rest = corners - corners[0]
    chosen = [int((rest * rest).sum(axis=1).argmax())]
    rest = corners - corners[chosen[0]]
    for _ in range(3):
        chosen.append(int((rest * rest).sum(axis=1).argmax()))
        direction = rest[chosen[-1]] / np.linalg.norm(rest[chosen[-1]])
        rest = rest - np.outer(rest @ direction, direction)
    return chosen


def _distance_bound(corners: FloatArray, point: FloatArray) -> float:
    """Return an upper bound [m] on the distance of a point (3,) from the convex hull of corners (N, 3).

    It is the distance from one point of the hull: the convex combination of corners, found by nonnegative least
    squares with a heavily weighted row for the sum of the weights, that is nearest to the point.
    """
    weights, _ = nnls(np.vstack([corners.T, np.full(len(corners), 1e3)]), np.append(point, 1e3))
    return float(np.linalg.norm(weights @ corners / weights.sum() - point))


def _make_cover(corners: FloatArray, radius: float) -> Cover:
    """Return the cover with these corners (N, 3) and radius [m]; the normals of its faces point outwards."""
    hull = ConvexHull(corners)
    kept = corners[hull.vertices]
    index = np.zeros(len(corners), dtype=int)
    index[hull.vertices] = np.arange(len(kept))
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in kept:
        points.append(corner)
    for triangle, plane in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = (int(i) for i in index[triangle])
        if np.cross(kept[b] - kept[a], kept[c] - kept[a]) @ plane[:3] < 0.0:
            b, c = c, b
        faces.append(coal.Triangle(a, b, c))
    return Cover(coal.Convex(points, faces), radius, kept)
