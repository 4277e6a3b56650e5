# SPDX-License-Identifier: Apache-2.0
"""Values of execution.

Poses are (4, 4) [m], in base_footprint unless said otherwise; joint vectors follow their group's order [rad, m].
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np
import numpy.typing as npt
from uncom_common.primitive import Primitive
from uncom_common.transforms import invert
from uncom_perception.types import Detection, TableSurface

FloatArray = npt.NDArray[np.float64]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


class Stage(IntEnum):
    """Stages of an execution; the same numbers as in ExecutionStatus.msg."""

    IDLE = 0
    AWAITING_APPROVAL = 1
    PLANNING = 2
    APPROACHING = 3
    GRASPING = 4
    LIFTING = 5
    TRANSFERRING = 6
    PLACING = 7
    RETREATING = 8
    HOMING = 9
    VERIFYING = 10
    DONE = 11
    FAILED = 12
    STOPPED = 13


@dataclass(frozen=True, slots=True)
class BasePose:
    """Where the base stands: base_footprint in odom, x and y [m], yaw about the vertical [rad]."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    @property
    def transform_base_to_odom(self) -> FloatArray:
        """The pose as a matrix (4, 4)."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[cos, -sin, 0.0, self.x], [sin, cos, 0.0, self.y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])

    def motion_in_odom(self, motion: FloatArray) -> FloatArray:
        """Return a motion (4, 4) of objects in base_footprint as one in odom."""
        base = self.transform_base_to_odom
        return np.asarray(base @ motion @ invert(base))

    def driven(self, distance: float) -> BasePose:
        """Return the pose after driving straight on by a distance [m], back if negative."""
        ahead = self.x + distance * float(np.cos(self.yaw)), self.y + distance * float(np.sin(self.yaw))
        return BasePose(*ahead, self.yaw)

    def distance_ahead(self, other: BasePose) -> float:
        """Return how far ahead of this pose another one is, along this one's heading [m]."""
        return (other.x - self.x) * float(np.cos(self.yaw)) + (other.y - self.y) * float(np.sin(self.yaw))


ODOM_ORIGIN = BasePose()


@dataclass(frozen=True, slots=True)
class ManipulationTask:
    """What is to be done with what, in one frame: odom where it is carried out, base_footprint where it is planned.

    target_pose is where the footprint centre of the moved object is to end on its support (4, 4);
    target is the receiving object for put_in, put_on and stack; scene holds everything else that was seen.
    """

    utterance_id: str
    index: int
    primitive: Primitive
    relation: str
    object: Detection
    scene: tuple[Detection, ...]
    table: TableSurface | None
    target: Detection | None = None
    target_pose: FloatArray | None = None
    object_text: str = ""
    target_text: str = ""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A solid: box with size (x, y, z) or upright cylinder with size (diameter, diameter, height), about its pose."""

    name: str
    shape: Literal["box", "cylinder"]
    size: tuple[float, float, float]
    pose: FloatArray


@dataclass(frozen=True, slots=True)
class Attachment:
    """Solids held in the hand; poses are relative to the grasping frame."""

    parts: tuple[Obstacle, ...]


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A timed motion: times (N,) [s], positions and velocities (N, J) of joint_names.

    The robot gives it up where a joint is farther than tolerance [rad, m] from it: it has met something; 0 is no limit.
    """

    joint_names: tuple[str, ...]
    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    tolerance: float = 0.0

    @property
    def duration_s(self) -> float:
        """Length of the motion [s]."""
        return float(self.times[-1])


@dataclass(frozen=True, slots=True)
class Status:
    """One change of stage, as it is published."""

    stage: Stage
    detail: str = ""
    arm: str = ""
    data: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an execution ended.

    in_hand is the label of what is held, or empty; verification what looking again found: the relation, whether it
    holds, the distances that were measured [m], and what else moved; tree what was tried, see tree_as_data.
    """

    success: bool
    stage: Stage
    reason: str
    in_hand: str = ""
    verification: dict[str, object] = field(default_factory=dict)
    tree: dict[str, object] = field(default_factory=dict)
