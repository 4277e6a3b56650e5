# SPDX-License-Identifier: Apache-2.0
"""The room: floor, walls, table with legs, and a lamp; wood, paint and light vary with the seed."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
from PIL import Image

from uncom_sim.types import Light, Table
from uncom_sim.world.options import ROOM, RoomOptions

Rgb = tuple[float, float, float]
Texture = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Room:
    """PyBullet id of the table, the lamp, and the textures (H, W, 3) of the bodies that have one by their ids."""

    table: int
    light: Light
    textures: dict[int, Texture]


def build_room(client: int, table: Table, rng: np.random.Generator, *, options: RoomOptions = ROOM) -> Room:
    """Build floor, walls and table into a PyBullet world; rng draws materials and light."""
    wood, paint, ground = (
        choices[int(rng.integers(len(choices)))] for choices in (options.woods, options.walls, options.floors)
    )
    textures: dict[int, Texture] = {}
    _floor(client, ground, rng, textures, options=options)
    _walls(client, paint, options=options)
    return Room(_table(client, table, wood, rng, textures, options=options), random_light(rng), textures)


def random_light(rng: np.random.Generator) -> Light:
    """Draw a lamp above the table, warm or cool; never from behind the robot, whose shadow would lie on the objects."""
    azimuth, tilt = rng.uniform(-1.4, 1.4), rng.uniform(0.25, 0.55)
    warmth = rng.uniform(-1.0, 1.0)
    level = rng.uniform(0.94, 1.0)
    return Light(
        direction=(float(tilt * np.cos(azimuth)), float(tilt * np.sin(azimuth)), 1.0),
        colour=(
            float(level * (1.0 - 0.02 * (1 - warmth))),
            float(level * 0.975),
            float(level * (0.96 - 0.04 * warmth)),
        ),
        ambient=float(rng.uniform(0.55, 0.65)),
        diffuse=float(rng.uniform(0.40, 0.50)),
    )


def _floor(
    client: int, colour: Rgb, rng: np.random.Generator, textures: dict[int, Texture], *, options: RoomOptions = ROOM
) -> None:
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    seen = pybullet.createVisualShape(
        pybullet.GEOM_BOX,
        halfExtents=[options.half_size_m, options.half_size_m, 0.01],
        visualFramePosition=[0.0, 0.0, -0.0105],
        rgbaColor=[1, 1, 1, 1],
        specularColor=[0, 0, 0],
        physicsClientId=client,
    )
    body: int = pybullet.createMultiBody(0, plane, seen, physicsClientId=client)
    grain = rng.normal(0.0, 0.012, (128, 128, 1))
    pixels = np.asarray(colour) + grain
    joints = (np.arange(128) % 16 == 0)[:, None] | (np.arange(128) % 16 == 0)[None]
    pixels[joints] *= 0.93
    textures[body] = _apply_texture(client, body, pixels)
    pybullet.changeDynamics(body, -1, lateralFriction=0.8, physicsClientId=client)


def _walls(client: int, colour: Rgb, *, options: RoomOptions = ROOM) -> None:
    """Stand walls behind the table and to both sides of it: nothing to touch, only to see."""
    places = (
        ([0.05, options.half_size_m, 1.3], [3.2, 0.0, 1.3]),
        ([options.half_size_m, 0.05, 1.3], [0.0, 3.4, 1.3]),
        ([options.half_size_m, 0.05, 1.3], [0.0, -3.4, 1.3]),
    )
    for half, centre in places:
        seen = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=[*colour, 1], specularColor=[0, 0, 0], physicsClientId=client
        )
        pybullet.createMultiBody(0, -1, seen, centre, physicsClientId=client)


def _table(
    client: int,
    table: Table,
    wood: Rgb,
    rng: np.random.Generator,
    textures: dict[int, Texture],
    *,
    options: RoomOptions = ROOM,
) -> int:
    """Build top and legs as one fixed body, its frame in the middle of the surface."""
    half_x, half_y = (table.x_max - table.x_min) / 2.0, (table.y_max - table.y_min) / 2.0
    leg_height = table.height - options.top_thickness_m
    halves = [[half_x, half_y, options.top_thickness_m / 2.0]]
    centres = [[0.0, 0.0, -options.top_thickness_m / 2.0]]
    for sx in (-1, 1):
        for sy in (-1, 1):
            halves.append([options.leg_m / 2.0, options.leg_m / 2.0, leg_height / 2.0])
            centres.append([sx * (half_x - 0.05), sy * (half_y - 0.05), -options.top_thickness_m - leg_height / 2.0])
    kinds = [pybullet.GEOM_BOX] * len(halves)
    touched = pybullet.createCollisionShapeArray(
        shapeTypes=kinds, halfExtents=halves, collisionFramePositions=centres, physicsClientId=client
    )
    seen = pybullet.createVisualShapeArray(
        shapeTypes=kinds,
        halfExtents=halves,
        visualFramePositions=centres,
        rgbaColors=[[1, 1, 1, 1]] * len(halves),
        physicsClientId=client,
    )
    middle = [(table.x_min + table.x_max) / 2.0, (table.y_min + table.y_max) / 2.0, table.height]
    body: int = pybullet.createMultiBody(0, touched, seen, middle, physicsClientId=client)
    textures[body] = _apply_texture(client, body, _grain(wood, rng))
    pybullet.changeDynamics(
        body, -1, lateralFriction=0.8, rollingFriction=0.0, spinningFriction=0.001, physicsClientId=client
    )
    return body


def _grain(wood: Rgb, rng: np.random.Generator, size: int = 256) -> npt.NDArray[np.float64]:
    """Draw faint wood grain along one direction (size, size, 3), colours from 0 to 1."""
    v, u = np.mgrid[0:size, 0:size] / size
    phase = rng.uniform(0.0, 10.0, 3)
    bend = 0.04 * np.sin(2 * np.pi * u + phase[0]) + 0.02 * np.sin(4 * np.pi * u + phase[1])
    rings = np.sin(2 * np.pi * (v + bend) * 9 + phase[2]) + 0.5 * np.sin(2 * np.pi * (v + bend) * 31)
    streaks = np.repeat(rng.normal(0.0, 1.0, (size, 16)), size // 16, axis=1)
    shade = 1.0 + 0.022 * rings + 0.012 * streaks
    joint = 0.008  # half the width of the joint between two planks, as a share of a plank
    planks = np.minimum((v * 4) % 1.0, 1.0 - (v * 4) % 1.0) < joint
    return np.asarray(np.clip(np.asarray(wood) * (shade * np.where(planks, 0.90, 1.0))[..., None], 0.0, 1.0))


def _apply_texture(client: int, body: int, pixels: npt.NDArray[np.float64]) -> Texture:
    """Put a texture (H, W, 3), colours from 0 to 1, on a whole body; return it as bytes."""
    texture_bytes = (np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8)
    with tempfile.TemporaryDirectory(prefix="uncom_") as folder:
        path = Path(folder) / "texture.png"
        Image.fromarray(texture_bytes).save(path)
        texture = pybullet.loadTexture(str(path), physicsClientId=client)
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, specularColor=[0, 0, 0], physicsClientId=client)
    return texture_bytes
