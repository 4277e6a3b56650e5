# SPDX-License-Identifier: Apache-2.0
"""Put a model into a PyBullet world."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
from PIL import Image

from uncom_sim.exceptions import SimError
from uncom_sim.objects.model import TILE_PX, Model, Part

FloatArray = npt.NDArray[np.float64]


def spawn(client: int, model: Model, position: npt.ArrayLike, yaw: float) -> int:
    """Make a free body of a model with its body frame at a position (3,) [m], turned by yaw [rad]; return its id.

    Raises:
        SimError: PyBullet refused the shapes.
    """
    with tempfile.TemporaryDirectory(prefix="uncom_") as folder:
        visual, texture = load_visual(client, model.parts, Path(folder))
        collision = _load_collision(client, model.hulls, Path(folder))
    orientation = pybullet.getQuaternionFromEuler([0.0, 0.0, yaw])
    body: int = pybullet.createMultiBody(
        baseMass=model.mass,
        baseCollisionShapeIndex=collision,
        baseVisualShapeIndex=visual,
        basePosition=np.asarray(position, dtype=float).tolist(),
        baseOrientation=orientation,
        baseInertialFramePosition=model.centre_of_mass.tolist(),
        physicsClientId=client,
    )
    if body < 0:
        raise SimError("PyBullet could not make an object's body; are there too many objects?")
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=model.contact.friction,
        rollingFriction=model.contact.rolling,
        spinningFriction=model.contact.spinning,
        restitution=model.contact.restitution,
        linearDamping=0.04,
        angularDamping=0.08,
        physicsClientId=client,
    )
    return body


def body_pose(client: int, body: int, centre_of_mass: FloatArray) -> FloatArray:
    """Return the pose (4, 4) of a body frame; PyBullet tells that of the centre of mass."""
    position, quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    pose = np.eye(4)
    pose[:3, :3] = np.reshape(pybullet.getMatrixFromQuaternion(quaternion), (3, 3))
    pose[:3, 3] = np.asarray(position) - pose[:3, :3] @ centre_of_mass
    return pose


def load_visual(client: int, parts: Sequence[Part], folder: Path) -> tuple[int, int]:
    """Load painted surfaces; return the visual shape and the texture to put on its body."""
    atlas = np.concatenate([part.tile for part in parts], axis=0)
    image = folder / "paint.png"
    Image.fromarray(atlas).save(image)
    mesh = folder / "visual.obj"
    mesh.write_text(_visual_obj(parts))
    shape: int = pybullet.createVisualShape(
        pybullet.GEOM_MESH, fileName=str(mesh), rgbaColor=[1, 1, 1, 1], specularColor=[0.1] * 3, physicsClientId=client
    )
    texture: int = pybullet.loadTexture(str(image), physicsClientId=client)
    if shape < 0 or texture < 0:
        raise SimError("PyBullet could not load an object's surface")
    return shape, texture


def _load_collision(client: int, hulls: Sequence[FloatArray], folder: Path) -> int:
    mesh = folder / "collision.obj"
    lines, first = [], 1
    for i, hull in enumerate(hulls):
        # PyBullet takes the corners of each group's faces and makes its convex hull; the faces need not close.
        lines.append(f"o hull_{i}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in hull]
        lines += [
            f"f {first + k} {first + (k + 1) % len(hull)} {first + (k + 2) % len(hull)}" for k in range(len(hull))
        ]
        first += len(hull)
    mesh.write_text("\n".join(lines) + "\n")
    shape: int = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=str(mesh), physicsClientId=client)
    if shape < 0:
        raise SimError("PyBullet could not load an object's collision shape")
    return shape


def _visual_obj(parts: Sequence[Part]) -> str:
    lines, first, rows = ["o visual"], 1, len(parts)
    for row, part in enumerate(parts):
        # Keep clear of the neighbouring tiles of the atlas.
        inset = np.clip(part.uv, 0.5 / TILE_PX, 1.0 - 0.5 / TILE_PX)
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in part.vertices]
        lines += [f"vt {u:.5f} {1.0 - (row + v) / rows:.5f}" for u, v in inset]
        lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in part.normals]
        lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in face + first) for face in part.faces]
        first += len(part.vertices)
    return "\n".join(lines) + "\n"
