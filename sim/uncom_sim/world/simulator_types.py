# SPDX-License-Identifier: Apache-2.0
"""Options of a simulator, and the states of joints and frames that it returns."""

from __future__ import annotations

from dataclasses import dataclass, field

from uncom_common.transforms import FloatArray

from uncom_sim.camera.noise import CameraNoise
from uncom_sim.robot.robot import RobotOptions


@dataclass(frozen=True, slots=True)
class SimulatorOptions:
    """What may differ between runs of one scene and seed."""

    robot: RobotOptions = field(default_factory=RobotOptions)
    noise: CameraNoise = field(default_factory=CameraNoise)
    start_time_s: float = 10.0
    overview_size: tuple[int, int] = (640, 480)
    shadows: bool = True
    light: float = 1.0  # how bright the lamp and the room are


@dataclass(frozen=True, slots=True)
class JointState:
    """All joints of the robot: positions [rad or m], velocities [/s], efforts [N m or N]."""

    names: tuple[str, ...]
    positions: FloatArray
    velocities: FloatArray
    efforts: FloatArray


@dataclass(frozen=True, slots=True)
class Frames:
    """Places (N, 3) [m] and quaternions (N, 4; x y z w) of child frames in their parents."""

    parents: tuple[str, ...]
    children: tuple[str, ...]
    places: FloatArray
    quaternions: FloatArray
