# SPDX-License-Identifier: Apache-2.0
"""Parameters of the execution node."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.exceptions import InvalidConfigError
from uncom_common.parameters import check_parameters, parameter

from uncom_tiago_exec.collision.options import MARGINS
from uncom_tiago_exec.trajectory.options import TIMING

POSITIVE = (
    "arm_acceleration",
    "torso_acceleration",
    "jerk_ratio",
    "planning_time_s",
    "state_timeout_s",
)  # parameters that must be greater than zero


@dataclass(frozen=True, slots=True)
class ExecutionConfig:
    """Each field is a parameter of the node."""

    require_approval: bool = parameter(
        default=True, description="wait for a yes on /uncom/answer before anything moves"
    )
    speed: float = parameter(
        0.8, "speed of all motions, as a share of the joints' top speed", minimum=0.05, maximum=1.0
    )
    arm_acceleration: float = parameter(3.0, "limit of the arm joints [rad/s^2]")
    torso_acceleration: float = parameter(0.25, "limit of the torso [m/s^2]")
    jerk_ratio: float = parameter(TIMING.jerk_ratio, "jerk limit as a multiple of acceleration [1/s]")
    scene_margin: float = parameter(MARGINS.scene, "least distance of the arm to things [m]", minimum=0.0, maximum=0.1)
    finger_margin: float = parameter(0.003, "least distance of fingers to the table [m]", minimum=0.0, maximum=0.1)
    planning_time_s: float = parameter(2.0, "time to look for grasps and ways [s]")
    grasp_attempts: int = parameter(3, "grasps to try before giving up", minimum=1)
    state_timeout_s: float = parameter(0.5, "joint states older than this stop it [s]")
    approval_timeout_s: float = parameter(60.0, "how long to wait for approval [s]")
    verify: bool = parameter(default=True, description="look again at the end and check the relation")
    drive_base: bool = parameter(
        default=True, description="drive up to 12 cm nearer and back where both arms reach too short"
    )
    preempt: bool = parameter(default=False, description="a new command stops the one being carried out")
    reliable_images: bool = parameter(default=True, description="QoS of image subscriptions")
    base_frame: str = parameter("base_footprint", "frame of all poses")
    odom_frame: str = parameter("odom", "frame that stays where it is while the base drives")
    seed: int = parameter(1, "of the random restarts")

    def __post_init__(self) -> None:
        """Refuse values that would be unsafe or useless.

        Raises:
            InvalidConfigError: one is; the text names the usable ones.
        """
        check_parameters(self)
        for name in POSITIVE:
            if getattr(self, name) <= 0.0:
                raise InvalidConfigError(name, getattr(self, name), "must be positive")
