# SPDX-License-Identifier: Apache-2.0
"""The TIAGo++ in a PyBullet world: joints follow set-points, the base drives, the grippers hold by friction."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
from uncom_common.transforms import FloatArray

from uncom_sim.exceptions import SimError
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.finger_friction import FingerFriction
from uncom_sim.robot.joint_names import ACTUATED, FINGERS, home_positions
from uncom_sim.robot.kinematics import Kinematics
from uncom_sim.robot.options import JOINT_DRIVES, JointDriveOptions
from uncom_sim.robot.physics_model import BASE_JOINTS, physics_urdf
from uncom_sim.robot.visual_meshes import with_file_paths

IntArray = npt.NDArray[np.intp]

TIME_STEP_S = 1.0 / 240.0


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """How the robot stands at the start [m, rad]: arms tucked, looking at the table."""

    torso: float = 0.35
    head: tuple[float, float] = (0.0, -0.95)
    finger: float = 0.0
    base: tuple[float, float, float] = (0.0, 0.0, 0.0)  # x, y, yaw


@dataclass(frozen=True, slots=True)
class JointReadings:
    """Position [rad or m], velocity [/s] and effort [N m or N] of the actuated joints, in the order of ACTUATED."""

    position: FloatArray
    velocity: FloatArray
    effort: FloatArray


class Robot:
    """One TIAGo++ in one PyBullet client."""

    def __init__(
        self, client: int, options: RobotOptions | None = None, *, joint_drive_options: JointDriveOptions = JOINT_DRIVES
    ) -> None:
        """Load the robot into a client and put it in its start pose.

        Raises:
            SimError: the model is missing or PyBullet refuses it.
        """
        self._joint_drive_options = joint_drive_options
        options = options or RobotOptions()
        self._client = client
        self.kinematics = Kinematics(tiago_urdf())
        self.body = _load(client)
        self.links = {"world": -1}
        indices: dict[str, int] = {}
        for index in range(pybullet.getNumJoints(self.body, physicsClientId=client)):
            info = pybullet.getJointInfo(self.body, index, physicsClientId=client)
            indices[info[1].decode()] = index
            self.links[info[12].decode()] = index
        self._joints = [indices[name] for name in ACTUATED]
        self._gains = (
            [joint_drive_options.position_gain] * (len(ACTUATED) + len(BASE_JOINTS)),
            [1.0] * (len(ACTUATED) + len(BASE_JOINTS)),
        )
        self._base = [indices[name] for name in BASE_JOINTS]
        joints = [self.kinematics.joints[name] for name in ACTUATED]
        self.lower = np.array([joint.lower for joint in joints])
        self.upper = np.array([joint.upper for joint in joints])
        self.max_velocity = np.array([joint.velocity for joint in joints])
        self._efforts = [*(joint.effort for joint in joints), *joint_drive_options.base_efforts]
        # The motor asks for gain * error / step, so this much error asks for the joint's full speed.
        self._max_error = self.max_velocity * TIME_STEP_S / joint_drive_options.position_gain
        self._spindles: list[tuple[FingerFriction, tuple[int, int]]] = []  # with their places among ACTUATED
        self._set_dynamics()
        self._place(options)
        self._allow_resting_overlaps()
        self.readings = self._read()

    def _set_dynamics(self) -> None:
        for index in range(-1, pybullet.getNumJoints(self.body, physicsClientId=self._client)):
            pybullet.changeDynamics(
                self.body,
                index,
                linearDamping=0.0,
                angularDamping=0.0,
                lateralFriction=0.6,
                physicsClientId=self._client,
            )
        for side, joints in FINGERS.items():
            fingers = [self.links[joint.replace("_joint", "_link")] for joint in joints]
            for finger in fingers:
                pybullet.changeDynamics(
                    self.body,
                    finger,
                    lateralFriction=self._joint_drive_options.pad_friction,
                    spinningFriction=0.02,
                    rollingFriction=0.002,
                    frictionAnchor=1,
                    physicsClientId=self._client,
                )
            pybullet.setCollisionFilterPair(self.body, self.body, *fingers, 0, physicsClientId=self._client)
            spindles = FingerFriction(self._client, self.body, side, (fingers[0], fingers[1]))
            self._spindles.append((spindles, (ACTUATED.index(joints[0]), ACTUATED.index(joints[1]))))

    def _place(self, options: RobotOptions) -> None:
        pose = home_positions(options.torso, options.head, options.finger)
        self._target = np.clip([pose[name] for name in ACTUATED], self.lower, self.upper)
        self._target_velocity = np.zeros(len(ACTUATED))
        for index, value in zip(self._joints, self._target, strict=True):
            pybullet.resetJointState(self.body, index, float(value), physicsClientId=self._client)
        self._base_target = np.array(options.base, dtype=float)
        for index, value in zip(self._base, self._base_target, strict=True):
            pybullet.resetJointState(self.body, index, float(value), physicsClientId=self._client)
        self._base_velocity = (0.0, 0.0)

    def _allow_resting_overlaps(self) -> None:
        """Let links pass through each other that overlap in the start pose: their models are coarser than they."""
        pybullet.performCollisionDetection(physicsClientId=self._client)
        for contact in pybullet.getContactPoints(self.body, self.body, physicsClientId=self._client):
            if contact[8] < 0.0:
                pybullet.setCollisionFilterPair(
                    self.body, self.body, contact[3], contact[4], 0, physicsClientId=self._client
                )

    def set_targets(self, joints: IntArray, positions: FloatArray, velocities: FloatArray) -> None:
        """Give actuated joints (indices into ACTUATED) set-points [rad or m] and the velocities they pass them at."""
        self._target[joints] = np.clip(positions, self.lower[joints], self.upper[joints])
        self._target_velocity[joints] = velocities

    def set_base_velocity(self, linear: float, angular: float) -> None:
        """Drive the base: along its own x axis [m/s] and about z [rad/s]."""
        self._base_velocity = (linear, angular)

    def apply(self) -> None:
        """Hand the set-points to the motors; call once before each physics step."""
        error = np.minimum(np.maximum(self._target - self.readings.position, -self._max_error), self._max_error)
        velocity = np.minimum(np.maximum(self._target_velocity, -self.max_velocity), self.max_velocity)
        goal = self.readings.position + error
        base, base_velocity = self._drive()
        pybullet.setJointMotorControlArray(
            self.body,
            [*self._joints, *self._base],
            pybullet.POSITION_CONTROL,
            targetPositions=[*goal.tolist(), *base.tolist()],
            targetVelocities=[*velocity.tolist(), *base_velocity.tolist()],
            forces=self._efforts,
            positionGains=self._gains[0],
            velocityGains=self._gains[1],
            physicsClientId=self._client,
        )

    def _drive(self) -> tuple[FloatArray, FloatArray]:
        """Move the base's set-point on by one step; it waits for a base that is held up."""
        linear, angular = self._base_velocity
        actual = self.base_pose()
        heading = actual[2] + 0.5 * angular * TIME_STEP_S
        velocity = np.array([linear * np.cos(heading), linear * np.sin(heading), angular])
        self._base_target = self._base_target + velocity * TIME_STEP_S
        self._base_target = actual + np.clip(
            self._base_target - actual, -self._joint_drive_options.base_lead, self._joint_drive_options.base_lead
        )
        return self._base_target, velocity

    def update(self) -> None:
        """Read the joints; call once after each physics step."""
        self.readings = self._read()
        for spindles, (first, second) in self._spindles:
            spindles.follow(float(self.readings.position[first]), float(self.readings.position[second]))

    def _read(self) -> JointReadings:
        states = pybullet.getJointStates(self.body, [*self._joints, *self._base], physicsClientId=self._client)
        table = np.array([(position, velocity, effort) for position, velocity, _, effort in states])
        self._base_state = table[len(self._joints) :, :2]
        return JointReadings(*table[: len(self._joints)].T)

    def base_pose(self) -> FloatArray:
        """Return the base's true x [m], y [m] and yaw [rad] in the world."""
        return np.asarray(self._base_state[:, 0].copy())

    def base_twist(self) -> tuple[float, float]:
        """Return the base's true velocity along its x axis [m/s] and about z [rad/s]: what the wheels turn by."""
        (_, vx), (_, vy), (yaw, angular) = self._base_state
        return float(vx * np.cos(yaw) + vy * np.sin(yaw)), float(angular)

    def base_matrix(self) -> FloatArray:
        """Return transform_base_footprint_to_world (4, 4)."""
        x, y, yaw = self.base_pose()
        matrix = np.eye(4)
        matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        matrix[:2, 3] = x, y
        return matrix

    def positions(self) -> dict[str, float]:
        """Return the position [rad or m] of every actuated joint."""
        return dict(zip(ACTUATED, self.readings.position.tolist(), strict=True))

    def frame(self, name: str) -> FloatArray:
        """Return transform_frame_to_world (4, 4) of any frame of the URDF.

        Raises:
            SimError: there is no such frame.
        """
        return np.asarray(self.base_matrix() @ self.kinematics.pose(name, self.positions()))


def _load(client: int) -> int:
    """Load the robot from a temporary file of its own: PyBullet remembers URDF texts by file name."""
    handle, path = tempfile.mkstemp(prefix="uncom_tiago_", suffix=".urdf")
    try:
        with os.fdopen(handle, "w") as file:
            file.write(with_file_paths(physics_urdf(tiago_urdf())))
        body: int = pybullet.loadURDF(
            path,
            useFixedBase=True,
            flags=pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION,
            physicsClientId=client,
        )
    except pybullet.error as err:
        raise SimError("PyBullet cannot load the robot: reinstall example-robot-data and pybullet") from err
    finally:
        Path(path).unlink(missing_ok=True)
    return body
