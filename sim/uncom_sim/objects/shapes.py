# SPDX-License-Identifier: Apache-2.0
"""Building blocks of objects: surfaces of revolution, tubes, rounded boxes, and hollow rings of convex wedges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import trimesh

from uncom_sim.types import NEGLIGIBLE

FloatArray = npt.NDArray[np.float64]
Profile = Sequence[tuple[float, float]]


def revolve(profile: Profile, segments: int = 40) -> trimesh.Trimesh:
    """Turn a profile of (radius, z) points, bottom to top on the outside, about the z axis [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    rz = np.asarray(profile, dtype=float)
    rings = np.stack([np.outer(rz[:, 0], np.cos(angles)), np.outer(rz[:, 0], np.sin(angles))], axis=-1)
    vertices = np.concatenate([rings, np.broadcast_to(rz[:, None, 1:2], (*rings.shape[:2], 1))], axis=-1)
    return _lofted(vertices, closed=False)


def tube(
    path: FloatArray, radii: npt.ArrayLike, segments: int = 20, up: tuple[float, float, float] = (0, 0, 1)
) -> trimesh.Trimesh:
    """Sweep ellipses along a path (N, 3); radii is (N,) or (N, 2): sideways and along up [m]."""
    path = np.asarray(path, dtype=float)
    radii = np.asarray(radii, dtype=float)
    both = np.column_stack([radii, radii]) if radii.ndim == 1 else radii
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents, np.asarray(up, dtype=float))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    over = np.cross(side, tangents)
    angles = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    rings = (
        path[:, None]
        + both[:, 0, None, None] * np.cos(angles)[None, :, None] * side[:, None]
        + both[:, 1, None, None] * np.sin(angles)[None, :, None] * over[:, None]
    )
    return _lofted(rings, closed=False)


def _lofted(rings: FloatArray, *, closed: bool) -> trimesh.Trimesh:
    """Join rings (N, S, 3) of points to a closed surface; ends that are not points get a cap."""
    count, segments = rings.shape[:2]
    index = np.arange(count * segments).reshape(count, segments)
    right = np.roll(index, -1, axis=1)
    quads = [
        np.stack([index[:-1], right[:-1], right[1:]], axis=-1).reshape(-1, 3),
        np.stack([index[:-1], right[1:], index[1:]], axis=-1).reshape(-1, 3),
    ]
    vertices = np.concatenate([rings.reshape(-1, 3), rings[0].mean(axis=0)[None], rings[-1].mean(axis=0)[None]])
    first, last = count * segments, count * segments + 1
    caps = [
        np.column_stack([right[0], index[0], np.full(segments, first)]),
        np.column_stack([index[-1], right[-1], np.full(segments, last)]),
    ]
    mesh = trimesh.Trimesh(vertices, np.concatenate([*quads, *([] if closed else caps)]), process=False)
    mesh.merge_vertices(digits_vertex=7)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def smooth_profile(points: Profile, count: int) -> list[tuple[float, float]]:
    """Draw a smooth curve (Catmull-Rom) through (radius, z) points and return count places along it [m]."""
    p = np.asarray(points, dtype=float)
    padded = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    at = np.linspace(0.0, len(p) - 1.0, count)
    curve = []
    for value in at:
        i = min(int(value), len(p) - 2)
        t = value - i
        a, b, c, d = padded[i : i + 4]
        point = 0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3)
        curve.append((max(float(point[0]), 0.0), float(point[1])))
    return curve


def rounded_box(size: tuple[float, float, float], radius: float, steps: int = 3) -> trimesh.Trimesh:
    """Return a box with rounded edges, standing on z = 0 [m]."""
    ball = trimesh.creation.uv_sphere(radius, count=[4 * steps, 4 * steps])
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    offsets = corners * (np.asarray(size) / 2.0 - radius)
    cloud = (np.asarray(ball.vertices)[None] + offsets[:, None]).reshape(-1, 3)
    box: trimesh.Trimesh = trimesh.convex.convex_hull(cloud)
    box.apply_translation([0.0, 0.0, size[2] / 2.0])
    return box


def box_hull(size: tuple[float, float, float], centre: tuple[float, float, float]) -> FloatArray:
    """Return the eight corners of a box [m]."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return np.asarray(corners * np.asarray(size) + np.asarray(centre))


def disc_hull(radius: float, z_low: float, z_high: float, segments: int = 16) -> FloatArray:
    """Return the corners of an upright prism close to a cylinder [m]."""
    return turned_hull([(radius, z_low), (radius, z_high)], segments)


def turned_hull(profile: Profile, segments: int = 12) -> FloatArray:
    """Return the corners of a convex turned body [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in (angles if r > NEGLIGIBLE else [0.0])]
    return np.asarray(points, dtype=float)


def ring_hulls(inner: Profile, outer: Profile, segments: int = 16) -> list[FloatArray]:
    """Return the convex wedges of a hollow turned wall between two profiles of as many (radius, z) points [m]."""
    angles = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    # Chords cut the inner circle short; moving the corners out by that much keeps the opening as wide as it looks.
    inner = [(r / np.cos(np.pi / segments), z) for r, z in inner]
    outer = [(r / np.cos(np.pi / segments / 2), z) for r, z in outer]
    wedges = []
    for i in range(len(inner) - 1):
        quad = (inner[i], outer[i], inner[i + 1], outer[i + 1])
        wedges += [
            np.array([[r * np.cos(a), r * np.sin(a), z] for r, z in quad for a in angles[k : k + 2]])
            for k in range(segments)
        ]
    return wedges
