# SPDX-License-Identifier: Apache-2.0
"""Parameters of the execution node."""

from __future__ import annotations

from dataclasses import dataclass, field

from uncom_common.exceptions import InvalidConfigError


@dataclass(frozen=True, slots=True)
class ExecutionConfig:
    """Each field is a parameter of the node."""

    require_approval: bool = field(
        default=True, metadata={"description": "wait for a yes on /uncom/answer before anything moves"}
    )
    speed: float = field(default=0.8, metadata={"description": "pace of all motions, share of the joints' top speed"})
    arm_acceleration: float = field(default=3.0, metadata={"description": "limit of the arm joints [rad/s^2]"})
    torso_acceleration: float = field(default=0.25, metadata={"description": "limit of the torso [m/s^2]"})
    jerk_ratio: float = field(default=12.0, metadata={"description": "jerk limit as a multiple of acceleration [1/s]"})
    scene_margin: float = field(default=0.01, metadata={"description": "least distance of the arm to things [m]"})
    finger_margin: float = field(default=0.003, metadata={"description": "least distance of fingers to the table [m]"})
    planning_time_s: float = field(default=2.0, metadata={"description": "time to look for grasps and ways [s]"})
    grasp_attempts: int = field(default=3, metadata={"description": "grasps to try before giving up"})
    state_timeout_s: float = field(default=0.5, metadata={"description": "joint states older than this stop it [s]"})
    approval_timeout_s: float = field(default=60.0, metadata={"description": "how long to wait for approval [s]"})
    verify: bool = field(default=True, metadata={"description": "look again at the end and check the relation"})
    drive_base: bool = field(
        default=True, metadata={"description": "drive up to 12 cm nearer and back where both arms reach too short"}
    )
    preempt: bool = field(default=False, metadata={"description": "a new command stops the one being carried out"})
    reliable_images: bool = field(default=True, metadata={"description": "QoS of image subscriptions"})
    base_frame: str = field(default="base_footprint", metadata={"description": "frame of all poses"})
    odom_frame: str = field(
        default="odom", metadata={"description": "frame that stays where it is while the base drives"}
    )
    seed: int = field(default=1, metadata={"description": "of the random restarts"})

    def __post_init__(self) -> None:
        """Reject values that would be unsafe or useless."""
        if not 0.05 <= self.speed <= 1.0:
            raise InvalidConfigError("speed", self.speed, "choose a share between 0.05 and 1")
        for name in ("arm_acceleration", "torso_acceleration", "jerk_ratio", "planning_time_s", "state_timeout_s"):
            if getattr(self, name) <= 0.0:
                raise InvalidConfigError(name, getattr(self, name), "must be positive")
        for name in ("scene_margin", "finger_margin"):
            if not 0.0 <= getattr(self, name) <= 0.1:
                raise InvalidConfigError(name, getattr(self, name), "choose between 0 and 0.1 m")
        if self.grasp_attempts < 1:
            raise InvalidConfigError("grasp_attempts", self.grasp_attempts, "at least one attempt is needed")
