# SPDX-License-Identifier: Apache-2.0
"""One simulated room with its robot and person, in steps of 1/240 s.

The same commands at the same times give the same pictures, sounds and physics.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pybullet
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import FloatArray

from uncom_sim.camera.noise import NoisyCamera
from uncom_sim.camera.rasteriser import Rasteriser, StaticLayer
from uncom_sim.camera.render_scene import RenderScene
from uncom_sim.camera.surfaces import Surface, from_bullet, painted
from uncom_sim.camera.views import HEAD_CAMERA, look_at, overview_camera
from uncom_sim.controllers.diff_drive import DiffDrive
from uncom_sim.controllers.joint_trajectory import TrajectoryController
from uncom_sim.controllers.robot_controllers import TRAJECTORY_CONTROLLERS
from uncom_sim.controllers.trajectory import SetPoint
from uncom_sim.objects.catalogue import model
from uncom_sim.robot.description import CAMERA_FRAME
from uncom_sim.robot.joint_names import ACTUATED, FINGERS, WHEELS
from uncom_sim.robot.kinematics import FrameTree
from uncom_sim.robot.robot import TIME_STEP_S, Robot
from uncom_sim.types import NEGLIGIBLE, Light, ObjectState, Scene
from uncom_sim.world.contact_counter import ContactCounter
from uncom_sim.world.microphone import Microphone
from uncom_sim.world.options import PHYSICS, PhysicsOptions
from uncom_sim.world.simulator_types import Frames, JointState, SimulatorOptions
from uncom_sim.world.world import World

Image = npt.NDArray[np.uint8]
IntArray = npt.NDArray[np.int32]
DepthImage = npt.NDArray[np.float32]


class Simulator:
    """Owns a PyBullet client with the world and the robot in it. Not thread safe: one thread does everything."""

    def __init__(
        self,
        scene: Scene,
        seed: int = 0,
        options: SimulatorOptions | None = None,
        *,
        physics_options: PhysicsOptions = PHYSICS,
    ) -> None:
        """Build the scene and let it come to rest.

        Raises:
            SimError: the robot's model is missing, or a shape of the scene cannot be made.
        """
        self._physics_options = physics_options
        self.options = options or SimulatorOptions()
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self._set_physics(physics_options)
        try:
            self.world = World(self.client, scene, seed, options=physics_options)
            self.world.settle()
            self.robot = Robot(self.client, self.options.robot)
        except Exception:
            self.close()
            raise
        self._prepare_joints()
        self.base = DiffDrive()
        self.microphone = Microphone(self.world.person.samples, self.options.start_time_s, seed)
        self._camera = NoisyCamera(self.options.noise, seed, HEAD_CAMERA.height, HEAD_CAMERA.width)
        self._steps = 0
        self._person_start_s: float | None = None
        links = self.robot.links
        fingers = {links[j.replace("_joint", "_link")]: i for i, side in enumerate(FINGERS) for j in FINGERS[side]}
        self.contacts = ContactCounter(
            self.client,
            self.robot.body,
            self.world.table_body,
            self.world.object_bodies,
            fingers,
            options=physics_options,
        )
        self._prepare_rendering(scene)

    def _prepare_joints(self) -> None:
        """Start the controllers at the present joint positions, and sort the frames into moving and fixed ones."""
        self._indices = {
            config.joints: np.array([ACTUATED.index(joint) for joint in config.joints])
            for config in TRAJECTORY_CONTROLLERS
        }
        joints = self.robot.kinematics.joints
        moving = (*ACTUATED, *WHEELS)
        self._moving = FrameTree([joints[name] for name in moving])
        self._fixed = FrameTree([joint for name, joint in joints.items() if name not in moving])
        self._followed: dict[str, SetPoint] = {}
        self.controllers = {
            config.name: TrajectoryController(config, self.joint_positions(config.joints))
            for config in TRAJECTORY_CONTROLLERS
        }

    def _set_physics(self, options: PhysicsOptions) -> None:
        """Set PyBullet's time step, solver and contacts."""
        pybullet.setTimeStep(TIME_STEP_S, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=options.solver_iterations,
            contactBreakingThreshold=options.contact_breaking_m,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )

    def _prepare_rendering(self, scene: Scene) -> None:
        """Gather what is visible from the head camera and from outside, and what casts shadows."""
        links = self.robot.links
        self._render_scene = RenderScene(self.client, self._surfaces())
        self._seen = self._render_scene.faces()
        # The camera is inside the model of the head.
        head = {(self.robot.body, links[name]) for name in ("head_1_link", "head_2_link")}
        self._seen_from_head = self._render_scene.faces(without=head)
        table, world = scene.table, self.world
        standing = {self.robot.body, world.table_body, world.hand_body, *world.object_bodies.values()}
        casters = self._render_scene.faces(only=standing)
        middle = (table.x_min, (table.y_min + table.y_max) / 2.0, table.height)
        self._rasteriser = Rasteriser(self._render_scene, middle, casters)
        self._hand_faces = self._render_scene.faces(only={self.world.hand_body})
        self._static: StaticLayer | None = None
        self._overview = look_at((table.x_max + 1.05, 1.5, 1.75), (0.45, -0.05, 0.78))

    def _surfaces(self) -> list[Surface]:
        """Gather all that can be seen."""
        world = self.world
        painted_bodies = {*world.object_bodies.values(), world.hand_body}
        surfaces = painted(world.hand_body, world.person.hand.parts)
        for obj in world.scene.objects:
            shape = model(obj.kind, obj.colour)
            surfaces += painted(world.object_bodies[obj.id], shape.parts, -shape.centre_of_mass)
        for index in range(pybullet.getNumBodies(physicsClientId=self.client)):
            body = pybullet.getBodyUniqueId(index, physicsClientId=self.client)
            if body not in painted_bodies:
                surfaces += from_bullet(self.client, body, world.textures.get(body))
        return surfaces

    def close(self) -> None:
        """End the simulation and free what PyBullet holds."""
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    @property
    def time_s(self) -> float:
        """Simulated time [s]."""
        return self.options.start_time_s + self._steps * TIME_STEP_S

    @property
    def steps(self) -> int:
        """Physics steps since the start."""
        return self._steps

    def step(self) -> None:
        """Advance by 1/240 s."""
        now = self.time_s
        readings = self.robot.readings
        for name, controller in self.controllers.items():
            joints, before = self._indices[controller.config.joints], self._followed.get(name)
            point = controller.update(now, readings.position[joints], readings.velocity[joints])
            if point is not before:
                self.robot.set_targets(joints, point.positions, point.velocities)
                self._followed[name] = point
        self.robot.set_base_velocity(*self.base.update(now, TIME_STEP_S))
        self.robot.apply()
        pybullet.stepSimulation(physicsClientId=self.client)
        self.robot.update()
        self.base.integrate(*self.robot.base_twist(), TIME_STEP_S)
        self._steps += 1
        if self._steps % self._physics_options.contact_steps == 0:
            self.contacts.update(self.time_s)

    def start_person(self) -> None:
        """Let the person speak, point and leave, from now on; a second call starts them again."""
        self._person_start_s = self.time_s
        self.microphone.speak(self.time_s)

    @property
    def person_present(self) -> bool:
        """Whether the person is speaking or pointing now."""
        return self._person_start_s is not None and not self.person_done

    @property
    def person_done(self) -> bool:
        """Whether the person has spoken, pointed and left."""
        if self._person_start_s is None:
            return False
        return self.time_s - self._person_start_s > self.world.person.duration_s

    def render_camera(self) -> tuple[Image, DepthImage]:
        """Return what the head camera sees now: rgb (480, 640, 3) and depth (480, 640) [m], NaN where unknown."""
        rgb, depth = self._render(HEAD_CAMERA, self.robot.frame(CAMERA_FRAME), self._seen_from_head)
        return self._camera.expose(rgb, self._steps), self._camera.measure(depth, self._steps)

    def film(self, person_s: float, exposure_s: float = 0.0, moments: int = 1) -> tuple[Image, DepthImage]:
        """Return what the head camera sees person_s after the person's start [s], physics standing still.

        What moves during the exposure is blurred: the colours are the mean of so many moments of it. Depth is that of
        its middle. Whoever films does not step: what stands static is drawn only once.
        """
        rgb, depth = self._render_moment(person_s)
        if moments > 1:
            others = [x for x in np.linspace(-0.5, 0.5, moments) if abs(x) > NEGLIGIBLE]  # the middle is there already
            total = rgb.astype(np.uint16)
            for offset in others:
                total += self._render_moment(person_s + float(offset) * exposure_s)[0]
            rgb = np.asarray(np.round(total / (len(others) + 1)), dtype=np.uint8)
        step = round(person_s / TIME_STEP_S)
        return self._camera.expose(rgb, step), self._camera.measure(depth, step)

    def _render_moment(self, person_s: float) -> tuple[Image, DepthImage]:
        pose, light = self.robot.frame(CAMERA_FRAME), self._scaled_light()
        if self._static is None:
            self.world.update_person(None)
            self._render_scene.update(light.direction)
            head = {(self.robot.body, self.robot.links[name]) for name in ("head_1_link", "head_2_link")}
            seen = self._render_scene.faces(without={*head, (self.world.hand_body, -1)})
            casters = self._render_scene.faces(
                only={self.robot.body, self.world.table_body, *self.world.object_bodies.values()}
            )
            self._static = self._rasteriser.static(HEAD_CAMERA, pose, light, seen, casters)
        self.world.update_person(person_s)
        self._render_scene.update(light.direction)
        return self._rasteriser.render_moving(self._static, HEAD_CAMERA, pose, light, self._hand_faces)

    def render_overview(self) -> Image:
        """Return what a bystander sees now (H, W, 3)."""
        return self._render(overview_camera(*self.options.overview_size), self._overview, self._seen)[0]

    def _render(self, camera: PinholeCamera, pose: FloatArray, faces: IntArray) -> tuple[Image, DepthImage]:
        start = self._person_start_s
        self.world.update_person(None if start is None or self.person_done else self.time_s - start)
        return self._draw(camera, pose, faces)

    def _draw(self, camera: PinholeCamera, pose: FloatArray, faces: IntArray) -> tuple[Image, DepthImage]:
        light = self._scaled_light()
        self._render_scene.update(light.direction)
        return self._rasteriser.render(camera, pose, light, faces, shadows=self.options.shadows)

    def _scaled_light(self) -> Light:
        """Return the room's light at the brightness that was asked for."""
        level, light = self.options.light, self.world.light
        return replace(light, ambient=level * light.ambient, diffuse=level * light.diffuse)

    def object_states(self) -> tuple[ObjectState, ...]:
        """Return the truth about every object, for scoring."""
        return self.world.object_states()

    def joint_state(self) -> JointState:
        """Return the state of every joint that moves, the wheels among them."""
        readings, odometry = self.robot.readings, self.base.odometry
        spin = 0.5 * odometry.angular * self.base.config.wheel_separation_m
        rolling = np.array([odometry.linear - spin, odometry.linear + spin]) / self.base.config.wheel_radius_m
        return JointState(
            (*ACTUATED, *WHEELS),
            np.concatenate([readings.position, odometry.wheels]),
            np.concatenate([readings.velocity, rolling]),
            np.concatenate([readings.effort, np.zeros(2)]),
        )

    def moving_frames(self) -> Frames:
        """Return each moving joint's transform, and odom -> base_footprint as the wheels tell it."""
        readings, o = self.robot.readings, self.base.odometry
        places, quaternions = self._moving.poses(np.concatenate([readings.position, o.wheels]))
        return Frames(
            ("odom", *self._moving.parents),
            ("base_footprint", *self._moving.children),
            np.vstack([(o.x, o.y, 0.0), places]),
            np.vstack([(0.0, 0.0, np.sin(o.yaw / 2), np.cos(o.yaw / 2)), quaternions]),
        )

    def fixed_frames(self) -> Frames:
        """Return the transforms of all other joints; casters and suspension do not move here."""
        places, quaternions = self._fixed.poses(np.zeros(len(self._fixed.parents)))
        return Frames(self._fixed.parents, self._fixed.children, places, quaternions)

    def joint_positions(self, joints: tuple[str, ...]) -> FloatArray:
        """Return the positions [rad or m] of actuated joints."""
        return np.asarray(self.robot.readings.position[self._indices[joints]])

    def joint_velocities(self, joints: tuple[str, ...]) -> FloatArray:
        """Return the velocities [rad/s or m/s] of actuated joints."""
        return np.asarray(self.robot.readings.velocity[self._indices[joints]])
