# SPDX-License-Identifier: Apache-2.0
"""The room, the table, the objects on it and the person, built into a PyBullet world."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
from scipy.spatial.transform import Rotation

from uncom_sim.objects.body import body_pose, load_visual, spawn
from uncom_sim.objects.catalogue import model
from uncom_sim.person.behaviour import PersonBehaviour, plan_behaviour
from uncom_sim.person.hand_model import Hand
from uncom_sim.person.hand_placement import Obstacle
from uncom_sim.types import Light, ObjectState, Point2, Scene
from uncom_sim.world.options import PHYSICS, PhysicsOptions
from uncom_sim.world.room import build_room

FloatArray = npt.NDArray[np.float64]


class World:
    """Everything of a scene but the robot. Physics steps are the caller's; the person moves only by update_person."""

    def __init__(self, client: int, scene: Scene, seed: int, *, options: PhysicsOptions = PHYSICS) -> None:
        """Build a scene into a connected PyBullet client; the seed draws light, materials, and the person.

        Raises:
            SimError: PyBullet refused a shape, or the person's voice is not known.
        """
        self._options = options
        self._client = client
        self.scene = scene
        # Streams of their own, so that a change of the voice does not change the light.
        room_rng, person_rng = (np.random.default_rng([seed, stream]) for stream in (1, 2))
        pybullet.setGravity(0.0, 0.0, options.gravity_m_s2, physicsClientId=client)
        self._room = build_room(client, scene.table, room_rng)
        self._bodies = {
            obj.id: spawn(client, model(obj.kind, obj.colour), self._standing(obj.id), obj.yaw) for obj in scene.objects
        }
        self.person: PersonBehaviour = self._rehearse(person_rng)
        self._hand = _show_hand(client, self.person.hand, options=options)
        self.update_person(None)

    @property
    def light(self) -> Light:
        """How to light the room in getCameraImage."""
        return self._room.light

    @property
    def table_body(self) -> int:
        """PyBullet id of the table, its frame in the middle of the top."""
        return self._room.table

    @property
    def textures(self) -> dict[int, npt.NDArray[np.uint8]]:
        """Textures (H, W, 3) of floor and table by PyBullet id, for a renderer of one's own."""
        return dict(self._room.textures)

    @property
    def object_bodies(self) -> dict[str, int]:
        """PyBullet ids of the objects on the table by their ids in the scene."""
        return dict(self._bodies)

    @property
    def hand_body(self) -> int:
        """PyBullet id of the person's hand and forearm; it collides with nothing."""
        return self._hand

    def settle(self, duration_s: float = 0.5) -> None:
        """Step physics until everything has come to rest after building [s of simulated time]."""
        step = pybullet.getPhysicsEngineParameters(physicsClientId=self._client)["fixedTimeStep"]
        for _ in range(round(duration_s / step)):
            pybullet.stepSimulation(physicsClientId=self._client)

    def object_states(self) -> tuple[ObjectState, ...]:
        """Return where everything is now."""
        states = []
        for obj in self.scene.objects:
            shape = model(obj.kind, obj.colour)
            pose = body_pose(self._client, self._bodies[obj.id], shape.centre_of_mass)
            states.append(ObjectState(obj.id, obj.kind, obj.colour, pose, shape.size))
        return tuple(states)

    def update_person(self, t_s: float | None) -> None:
        """Move the hand to where it is t_s after the person's start [s]; None takes it away."""
        pose = None if t_s is None else self.person.hand_at(t_s)
        position, quaternion = self._options.hidden_place_m, (0.0, 0.0, 0.0, 1.0)
        if pose is not None:
            position = tuple(pose[:3, 3])
            quaternion = tuple(Rotation.from_matrix(pose[:3, :3]).as_quat())
        pybullet.resetBasePositionAndOrientation(self._hand, position, quaternion, physicsClientId=self._client)

    def _standing(self, object_id: str) -> FloatArray:
        """Place (3,) of an object's body frame when it stands on the table."""
        obj = self.scene.object(object_id)
        below = model(obj.kind, obj.colour).bounds[0, 2]
        return np.array([obj.x, obj.y, self.scene.table.height - below + self._options.drop_m])

    def _rehearse(self, rng: np.random.Generator) -> PersonBehaviour:
        pointed = {"object": self.scene.point_object, "target": self.scene.point_target}
        targets = {role: self._place(what) for role, what in pointed.items() if what is not None}
        obstacles = [
            Obstacle(self._standing(obj.id), _upright_half_size(model(obj.kind, obj.colour).size, obj.yaw))
            for obj in self.scene.objects
        ]
        return plan_behaviour(self.scene.say, targets, obstacles, self.scene.table, self.scene.person, rng)

    def _place(self, what: str | Point2) -> FloatArray:
        if isinstance(what, str):
            return self._standing(what)
        return np.array([*what, self.scene.table.height])


def _upright_half_size(size: FloatArray, yaw: float) -> FloatArray:
    c, s = abs(np.cos(yaw)), abs(np.sin(yaw))
    return np.array([c * size[0] + s * size[1], s * size[0] + c * size[1], size[2]]) / 2.0


def _show_hand(client: int, hand: Hand, *, options: PhysicsOptions = PHYSICS) -> int:
    with tempfile.TemporaryDirectory(prefix="uncom_") as folder:
        visual, texture = load_visual(client, hand.parts, Path(folder))
    body: int = pybullet.createMultiBody(0, -1, visual, options.hidden_place_m, physicsClientId=client)
    pybullet.changeVisualShape(body, -1, textureUniqueId=texture, physicsClientId=client)
    return body
