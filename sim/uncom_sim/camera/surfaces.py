# SPDX-License-Identifier: Apache-2.0
"""Visible surfaces: painted triangles, each fixed to a link of a PyBullet body."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pybullet
import trimesh
from uncom_common.transforms import FloatArray, matrix_from_pose

from uncom_sim.camera.options import RENDER_SCENE, RenderSceneOptions
from uncom_sim.objects.model import Part
from uncom_sim.robot.visual_meshes import read_light_mesh

Texture = npt.NDArray[np.uint8]
IntArray = npt.NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Surface:
    """Triangles in the frame of a link (-1: the body's base): vertices, normals (N, 3), uv (N, 2), faces (M, 3).

    `uv` are places in the texture (H, W, 3), both from 0 to 1, v from the top row down.
    """

    body: int
    link: int
    vertices: FloatArray
    normals: FloatArray
    uv: FloatArray
    faces: IntArray
    texture: Texture


def plain(rgba: Sequence[float]) -> Texture:
    """Return a texture of one colour, components from 0 to 1."""
    colour = np.clip(np.asarray(rgba[:3]) * 255.0 + 0.5, 0, 255).astype(np.uint8)
    return np.broadcast_to(colour, (2, 2, 3)).copy()


def painted(body: int, parts: Iterable[Part], offset: npt.ArrayLike = (0.0, 0.0, 0.0)) -> list[Surface]:
    """Return the surfaces of a painted model on a body, moved by an offset (3,) into its base frame."""
    shift = np.asarray(offset, dtype=float)
    return [
        Surface(body, -1, part.vertices + shift, part.normals, part.uv, part.faces.astype(np.int32), part.tile)
        for part in parts
    ]


def from_bullet(
    client: int, body: int, texture: Texture | None = None, *, options: RenderSceneOptions = RENDER_SCENE
) -> list[Surface]:
    """Return the surfaces of a body made of PyBullet's own boxes, cylinders and spheres, and of our light meshes."""
    surfaces = []
    for shape in pybullet.getVisualShapeData(body, physicsClientId=client):
        _, link, kind, dimensions, file, place, turn, rgba = shape[:8]
        made = _geometry(kind, dimensions, file.decode(), options=options)
        if made is None:
            continue
        vertices, normals, uv, faces = made
        matrix = matrix_from_pose(place, turn)
        surfaces.append(
            Surface(
                body,
                link,
                vertices @ matrix[:3, :3].T + matrix[:3, 3],
                normals @ matrix[:3, :3].T,
                uv,
                faces.astype(np.int32),
                plain(rgba) if texture is None else texture,
            )
        )
    return surfaces


def _geometry(
    kind: int, dimensions: Sequence[float], file: str, *, options: RenderSceneOptions = RENDER_SCENE
) -> tuple[Any, Any, Any, Any] | None:
    """Return vertices, normals, uv and faces of one shape, or None for what cannot be seen."""
    if kind == pybullet.GEOM_BOX:
        return _box(dimensions, options=options)
    if kind == pybullet.GEOM_CYLINDER:
        mesh = trimesh.creation.cylinder(radius=dimensions[1], height=dimensions[0], sections=24)
    elif kind == pybullet.GEOM_SPHERE:
        mesh = trimesh.creation.icosphere(subdivisions=3, radius=dimensions[0])
    elif kind == pybullet.GEOM_MESH and Path(file).suffix == ".obj" and Path(file).exists():
        return _mesh(file, np.asarray(dimensions, dtype=float))
    else:
        return None
    flat = trimesh.graph.smooth_shade(mesh, angle=0.7, facet_minarea=None)
    vertices = np.asarray(flat.vertices)
    return vertices, np.asarray(flat.vertex_normals), np.full((len(vertices), 2), 0.5), np.asarray(flat.faces)


def _mesh(file: str, scale: FloatArray) -> tuple[Any, Any, Any, Any]:
    vertices, normals, faces = read_light_mesh(Path(file))
    turned = normals / scale
    turned = turned / np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-9)
    # A mirrored mesh would show its inside.
    outward = faces if np.prod(scale) > 0.0 else faces[:, ::-1]
    return vertices * scale, turned, np.full((len(vertices), 2), 0.5), outward


def _box(
    size: Sequence[float], *, options: RenderSceneOptions = RENDER_SCENE
) -> tuple[FloatArray, FloatArray, FloatArray, npt.NDArray[np.int64]]:
    """Build a box with the whole texture on each side, in cells of at most half a metre.

    The rasteriser does not clip: what reaches behind the camera is left out, and must therefore be small.
    """
    pieces: list[tuple[FloatArray, FloatArray, FloatArray, npt.NDArray[np.int64]]] = []
    extent = np.asarray(size, dtype=float)
    first = 0
    for axis in range(3):
        across = [(axis + 1) % 3, (axis + 2) % 3]
        cells = np.maximum(1, np.ceil(extent[across] / options.cell_m)).astype(int)
        grid = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, n + 1) for n in cells), indexing="ij"), -1).reshape(-1, 2)
        corner = (np.arange(cells[0])[:, None] * (cells[1] + 1) + np.arange(cells[1])).reshape(-1)
        right = corner + cells[1] + 1
        quads = np.concatenate(
            [np.stack([corner, right, right + 1], -1), np.stack([corner, right + 1, corner + 1], -1)]
        )
        for sign in (-1.0, 1.0):
            side = np.zeros((len(grid), 3))
            side[:, axis] = sign / 2.0
            side[:, across] = grid - 0.5
            normals = np.tile(np.eye(3)[axis] * sign, (len(grid), 1))
            pieces.append((side * extent, normals, grid, (quads if sign > 0 else quads[:, ::-1]) + first))
            first += len(grid)
    vertices, normals, uv, faces = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    return vertices, normals, uv, faces
