# SPDX-License-Identifier: Apache-2.0
"""Parameters of the driver node."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from uncom_common.exceptions import InvalidConfigError

from uncom_sim.camera.noise import CameraNoise
from uncom_sim.robot.robot import TIME_STEP_S, RobotOptions
from uncom_sim.types import Scene
from uncom_sim.world.scene_file import load_scenario, load_scene
from uncom_sim.world.scene_variation import vary_scene
from uncom_sim.world.simulator_types import SimulatorOptions


def _about(default: Any, description: str) -> Any:
    return field(default=default, metadata={"description": description})


@dataclass(frozen=True)
class DriverConfig:
    """What the simulated robot's driver can be told; rates are in simulated time."""

    scene_file: str = _about("", "scene as JSON; takes the place of a scenario")
    scenario: str = _about("iv", "name of a shipped scenario, arranged by the seed")
    say: str = _about("", "sentence to say instead of the scene's own")
    seed: int = _about(0, "draws light, voice, hand and noise")
    real_time_factor: float = _about(1.0, "most simulated seconds per second; 0 is no limit")
    camera_rate_hz: float = _about(8.0, "frames of the head camera; the robot has 30")
    camera_rate_idle_hz: float = _about(0.0, "the same while nobody is there; 0 is no difference")
    overview_rate_hz: float = _about(4.0, "frames of the view from outside")
    joint_state_rate_hz: float = _about(50.0, "joint states, transforms and odometry")
    clock_rate_hz: float = _about(50.0, "messages on /clock; each costs every node some time")
    noise: float = _about(1.0, "camera noise; 0 is a perfect camera")
    shadows: bool = _about(True, "things cast shadows")
    torso: float = _about(0.35, "height of the torso at the start [m]")
    head_tilt: float = _about(-0.95, "head_2_joint at the start [rad]; down is negative")
    start_time_s: float = _about(10.0, "simulated time at the start [s]")

    def __post_init__(self) -> None:
        """Reject what cannot be simulated."""
        for name in ("real_time_factor", "camera_rate_idle_hz", "overview_rate_hz", "noise"):
            if getattr(self, name) < 0.0:
                raise InvalidConfigError(name, getattr(self, name), "must not be negative")
        for name in ("camera_rate_hz", "joint_state_rate_hz", "clock_rate_hz"):
            if not 0.0 < getattr(self, name) <= 1.0 / TIME_STEP_S:
                raise InvalidConfigError(name, getattr(self, name), "must be above 0 and at most 240")
        if self.start_time_s <= 0.0:
            raise InvalidConfigError("start_time_s", self.start_time_s, "must be above 0")
        if self.seed < 0:
            raise InvalidConfigError("seed", self.seed, "must not be negative")

    def scene(self) -> Scene:
        """Read the scene.

        Raises:
            SceneError: it is missing or cannot be used.
        """
        say = self.say or None
        if self.scene_file:
            return load_scene(self.scene_file, say)
        return vary_scene(load_scenario(self.scenario, say), self.seed)

    def simulator_options(self) -> SimulatorOptions:
        """Gather what the simulator needs."""
        return SimulatorOptions(
            robot=RobotOptions(torso=self.torso, head=(0.0, self.head_tilt)),
            noise=CameraNoise().scaled(self.noise),
            start_time_s=self.start_time_s,
            shadows=self.shadows,
        )
