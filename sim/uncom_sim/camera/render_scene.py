# SPDX-License-Identifier: Apache-2.0
"""All surfaces of a scene in one set of arrays, kept where PyBullet says their bodies are."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pybullet
from uncom_common.transforms import FloatArray, matrix_from_pose

from uncom_sim.camera.options import RENDER_SCENE, RenderSceneOptions
from uncom_sim.camera.surfaces import Surface, Texture

Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int32]


@dataclass(slots=True)
class _Piece:
    """The vertices of one link and where they were last put."""

    body: int
    link: int
    rows: slice
    vertices: Float32Array
    normals: Float32Array
    pose: FloatArray | None = None


class RenderScene:
    """Vertices in the world, how they face the lamp, and where each takes its colour from."""

    def __init__(self, client: int, surfaces: Sequence[Surface], *, options: RenderSceneOptions = RENDER_SCENE) -> None:
        """Stack the triangles and textures of all surfaces of a PyBullet client's bodies."""
        self._options = options
        self._client = client
        self.atlas, places = _pack([surface.texture for surface in surfaces], options=options)
        order = sorted(range(len(surfaces)), key=lambda i: (surfaces[i].body, surfaces[i].link))
        count = sum(len(surface.vertices) for surface in surfaces)
        self.vertices = np.zeros((count, 3), np.float32)
        # Per vertex: u and v in the atlas (0 to 1), and how much it faces the lamp (0 to 1).
        self.attributes = np.zeros((count, 3), np.float32)
        self._light = np.array([0.0, 0.0, 1.0], np.float32)
        self._pieces: list[_Piece] = []
        self.version = 0  # grows when something moves
        faces: list[tuple[int, int, IntArray]] = []
        first = 0
        for i in order:
            surface = surfaces[i]
            rows = slice(first, first + len(surface.vertices))
            self.attributes[rows, :2] = _atlas_places(surface.uv, places[i], self.atlas.shape)
            faces.append((surface.body, surface.link, surface.faces + np.int32(first)))
            self._add(surface, rows)
            first = rows.stop
        self._faces = faces

    def _add(self, surface: Surface, rows: slice) -> None:
        vertices, normals = surface.vertices.astype(np.float32), surface.normals.astype(np.float32)
        last = self._pieces[-1] if self._pieces else None
        if last is not None and (last.body, last.link) == (surface.body, surface.link):
            last.rows = slice(last.rows.start, rows.stop)
            last.vertices = np.concatenate([last.vertices, vertices])
            last.normals = np.concatenate([last.normals, normals])
        else:
            self._pieces.append(_Piece(surface.body, surface.link, rows, vertices, normals))

    def faces(self, without: Collection[tuple[int, int]] = (), only: Collection[int] | None = None) -> IntArray:
        """Return the triangles (M, 3) of all surfaces but those of some (body, link), of all bodies or only some."""
        kept = [(body, f) for body, link, f in self._faces if (body, link) not in without]
        return np.concatenate([f for body, f in kept if only is None or body in only])

    def update(self, light: npt.ArrayLike) -> None:
        """Put everything where its body is now; `light` (3,) points to the lamp."""
        direction = np.asarray(light, dtype=np.float32)
        direction = direction / np.float32(np.linalg.norm(direction))
        turned = not np.array_equal(direction, self._light)
        self._light = direction
        moved = turned
        for piece in self._pieces:
            pose = self._pose(piece.body, piece.link)
            if (
                not turned
                and piece.pose is not None
                and np.abs(pose - piece.pose).max() < self._options.motion_tolerance
            ):
                continue
            piece.pose, moved = pose, True
            rotation, place = pose[:3, :3].astype(np.float32), pose[:3, 3].astype(np.float32)
            self.vertices[piece.rows] = piece.vertices @ rotation.T + place
            facing = piece.normals @ (rotation.T @ direction)
            self.attributes[piece.rows, 2] = np.clip(facing, 0.0, 1.0)
        self.version += int(moved)

    def _pose(self, body: int, link: int) -> FloatArray:
        if link < 0:
            place, turn = pybullet.getBasePositionAndOrientation(body, physicsClientId=self._client)
        else:
            state = pybullet.getLinkState(body, link, computeForwardKinematics=True, physicsClientId=self._client)
            place, turn = state[4], state[5]
        return matrix_from_pose(place, turn)


def _atlas_places(uv: FloatArray, place: tuple[int, int, int, int], atlas: tuple[int, ...]) -> FloatArray:
    """Return where places in a texture are in the atlas, half a pixel clear of its neighbours."""
    row, column, height, width = place
    pixels = np.clip(uv * (width, height), 0.5, np.array([width, height]) - 0.5) + np.array([column - 0.5, row - 0.5])
    return np.asarray(pixels / (atlas[1], atlas[0]))


def _pack(
    textures: Sequence[Texture], *, options: RenderSceneOptions = RENDER_SCENE
) -> tuple[Texture, list[tuple[int, int, int, int]]]:
    """Put textures (H, W, 3) into one picture, in rows; return it and the (row, column, height, width) of each."""
    places: list[tuple[int, int, int, int]] = [(0, 0, 0, 0)] * len(textures)
    row = column = height = 0
    for i in sorted(range(len(textures)), key=lambda i: -textures[i].shape[0]):
        h, w = textures[i].shape[:2]
        if column + w > options.atlas_width_px:
            row, column, height = row + height, 0, 0
        places[i] = (row, column, h, w)
        column, height = column + w, max(height, h)
    atlas = np.zeros((row + height, max(options.atlas_width_px, *(place[3] for place in places)), 3), np.uint8)
    for texture, (top, left, h, w) in zip(textures, places, strict=True):
        atlas[top : top + h, left : left + w] = texture
    return atlas, places
