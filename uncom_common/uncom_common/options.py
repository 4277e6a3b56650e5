# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune projection, the buffer of transforms, the loading of weights, and nodes at their end.

Beside them stand the dimensions of the robot that several packages need.
"""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ProjectionOptions:
    """Which points a camera projects."""

    min_depth_m: float = tunable(1e-6, unit="m", meaning="points that are nearer along the optical axis have no pixel")


@dataclass(frozen=True, slots=True)
class TransformBufferOptions:
    """Which transforms are kept, and how far in time they hold."""

    keep_s: float = tunable(30.0, unit="s", meaning="how long transforms of moving frames are kept")
    max_extrapolation_s: float = tunable(
        0.5, unit="s", meaning="how long the first and the last pose of a frame hold before and after it"
    )
    restart_jump_s: float = tunable(
        1.0, unit="s", meaning="a larger step back in time is a recording that starts again"
    )
    max_chain: int = tunable(200, meaning="frames from one to its root, beyond which they form a loop")


@dataclass(frozen=True, slots=True)
class WeightLoadingOptions:
    """How weights of large models are looked for."""

    hub_timeout_s: float = tunable(
        5.0, unit="s", meaning="longest wait for the model hub; its own client tries a minute"
    )
    max_error_characters: int = tunable(200, meaning="characters of the first line of a library's error that are told")


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """How a node ends."""

    shutdown_timeout_s: float = tunable(2.0, unit="s", meaning="longest wait for a callback at the end")


@dataclass(frozen=True, slots=True)
class RobotDimensions:
    """Dimensions of TIAGo++."""

    shoulder_y_m: float = tunable(
        0.19,
        unit="m",
        meaning="distance of each shoulder from the middle plane of the robot (left: y is positive, REP 103)",
        source="tiago_dual.urdf: y of arm_left_1_joint in torso_lift_link",
    )


PROJECTION = ProjectionOptions()
TRANSFORM_BUFFER = TransformBufferOptions()
WEIGHT_LOADING = WeightLoadingOptions()
NODE = NodeOptions()
ROBOT = RobotDimensions()
