# SPDX-License-Identifier: Apache-2.0
"""The model of an object: painted surfaces, convex collision hulls, mass, friction and opening."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import trimesh
from scipy.spatial import ConvexHull

from uncom_sim.objects.palette import Rgb

FloatArray = npt.NDArray[np.float64]
Tile = npt.NDArray[np.uint8]

TILE_PX = 64


@dataclass(frozen=True, slots=True)
class Part:
    """One painted surface: vertices, normals (N, 3), texture coordinates (N, 2) in its tile, faces (M, 3)."""

    vertices: FloatArray
    normals: FloatArray
    uv: FloatArray
    faces: npt.NDArray[np.int64]
    tile: Tile


@dataclass(frozen=True, slots=True)
class Opening:
    """The inside of a container or the flat of a plate: centre and radius at the rim, floor and rim heights [m]."""

    centre: tuple[float, float]
    radius: float
    floor_z: float
    rim_z: float


@dataclass(frozen=True, slots=True)
class Contact:
    """How the surface touches: Coulomb, rolling and spinning friction coefficients (the latter two are lengths [m])."""

    friction: float = 0.8
    rolling: float = 0.0
    spinning: float = 0.001
    restitution: float = 0.02


@dataclass(frozen=True, slots=True)
class Model:
    """One object in its body frame (z up, origin in the middle of its height).

    Parts are what is seen, hulls (each (N, 3)) what is touched, footprint (N, 2) the outline on the table
    counter-clockwise, centre_of_mass (3,), bounds (2, 3) the lowest and highest corner [m]; mass in kg.
    """

    parts: tuple[Part, ...]
    hulls: tuple[FloatArray, ...]
    mass: float
    centre_of_mass: FloatArray
    contact: Contact
    footprint: FloatArray
    bounds: FloatArray
    opening: Opening | None = None

    @property
    def size(self) -> FloatArray:
        """Length, width and height (3,) [m]."""
        return np.asarray(self.bounds[1] - self.bounds[0])


def flat_tile(rgb: Rgb) -> Tile:
    """Return a tile of one colour."""
    colour = np.clip(np.round(np.asarray(rgb) * 255.0), 0, 255).astype(np.uint8)
    return np.broadcast_to(colour, (TILE_PX, TILE_PX, 3)).copy()


def ramp_tile(stops: Sequence[tuple[float, Rgb]]) -> Tile:
    """Return a tile whose colour runs along u (left to right) through the stops (place from 0 to 1, colour)."""
    at = (np.arange(TILE_PX) + 0.5) / TILE_PX
    places = [stop for stop, _ in stops]
    row = np.stack([np.interp(at, places, [rgb[c] for _, rgb in stops]) for c in range(3)], axis=-1)
    return np.broadcast_to(np.round(row * 255.0).astype(np.uint8), (TILE_PX, TILE_PX, 3)).copy()


def paint(
    mesh: trimesh.Trimesh,
    colour: Rgb | Tile,
    uv_of: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
    crease_deg: float = 40.0,
) -> Part:
    """Shade a mesh smoothly, except over edges sharper than crease_deg, and paint it.

    Args:
        mesh: the surface, in the body frame [m].
        colour: one colour, or a tile that uv_of maps to.
        uv_of: from vertices and normals (N, 3) to places in the tile (N, 2), both from 0 to 1.
        crease_deg: edges that bend more than this stay sharp [degrees].
    """
    shaded = trimesh.graph.smooth_shade(mesh, angle=float(np.radians(crease_deg)), facet_minarea=None)
    vertices, normals = np.array(shaded.vertices), np.array(shaded.vertex_normals)
    uv = np.full((len(vertices), 2), 0.5) if uv_of is None else np.clip(uv_of(vertices, normals), 0.01, 0.99)
    tile = colour if isinstance(colour, np.ndarray) else flat_tile(colour)
    return Part(vertices, normals, uv, np.array(shaded.faces), tile)


def assemble(
    parts: Sequence[Part],
    hulls: Sequence[FloatArray],
    mass: float,
    contact: Contact,
    opening: Opening | None = None,
) -> Model:
    """Move pieces built with their bottom at z = 0 to the body frame and derive outline, bounds and centre of mass."""
    points = np.concatenate([part.vertices for part in parts])
    middle = np.array([0.0, 0.0, (points[:, 2].min() + points[:, 2].max()) / 2.0])
    moved_parts = tuple(replace(part, vertices=part.vertices - middle) for part in parts)
    moved_hulls = tuple(np.asarray(hull, dtype=float) - middle for hull in hulls)
    bounds = np.stack([points.min(axis=0), points.max(axis=0)]) - middle
    weights, centres = zip(*(_volume_and_centre(hull) for hull in moved_hulls), strict=True)
    centre_of_mass = np.average(np.asarray(centres), axis=0, weights=np.asarray(weights))
    outline = points[ConvexHull(points[:, :2]).vertices, :2]
    if opening is not None:
        opening = replace(opening, floor_z=opening.floor_z - middle[2], rim_z=opening.rim_z - middle[2])
    return Model(moved_parts, moved_hulls, mass, centre_of_mass, contact, outline, bounds, opening)


def _volume_and_centre(hull: FloatArray) -> tuple[float, FloatArray]:
    solid = trimesh.convex.convex_hull(hull)
    return float(solid.volume), np.asarray(solid.center_mass)
