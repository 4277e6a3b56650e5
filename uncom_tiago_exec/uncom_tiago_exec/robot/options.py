# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune robot."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ClearanceMapOptions:
    """How the map of self-collision clearances is stored."""

    cells: int = tunable(128, meaning="cells a side of a pair's map over two joints")
    joints_between: int = tunable(2, meaning="joints between the links of a pair in the map: its two axes")
    unit_m: float = tunable(
        0.001,
        unit="m",
        meaning="unit of the distances in the file: bytes, row after row, compressed by zlib and in base 64",
    )
    slack_m: float = tunable(0.0003, unit="m", meaning="how far a link may move between the angles that are looked at")


@dataclass(frozen=True, slots=True)
class ConvexCoverOptions:
    """How meshes are covered by convex bodies."""

    max_corners: int = tunable(32, meaning="corners of a convex body, at most")
    slack_m: float = tunable(1e-05, unit="m", meaning="allowance for the rounding of what the file holds")
    prism_sides: int = tunable(12, meaning="sides of the prism around a cylinder")
    coarse_m: float = tunable(0.004, unit="m", meaning="distance beyond its mesh up to which a body need not be cut")
    cut_shares: tuple[float, ...] = tunable(
        (0.3, 0.4, 0.5, 0.6, 0.7), meaning="shares of the extent where a body is tried to be cut"
    )
    cuts: int = tunable(3, meaning="cuts in a row: into at most eight bodies")


@dataclass(frozen=True, slots=True)
class GripperOptions:
    """How a finger of the gripper moves."""

    reach_m: float = tunable(0.044, unit="m", meaning="travel of one finger", source="URDF of PAL's parallel gripper")
    speed_m_s: float = tunable(0.04, unit="m/s", meaning="speed of one finger")
    least_duration_s: float = tunable(0.3, unit="s", meaning="least duration of a motion of the fingers")


@dataclass(frozen=True, slots=True)
class ReachBoundOptions:
    """How far a joint can move a body."""

    slack_m: float = tunable(0.002, unit="m", meaning="allowance that is added to every bound")


@dataclass(frozen=True, slots=True)
class SelfCollisionSampleOptions:
    """How pairs of links that cannot meet are found."""

    samples: int = tunable(20000, meaning="random configurations that are looked at")
    widest_range: float = tunable(10.0, meaning="range of a joint [rad, or m] beyond which it counts as unlimited")


CLEARANCE_MAP = ClearanceMapOptions()
CONVEX_COVERS = ConvexCoverOptions()
GRIPPER = GripperOptions()
REACH_BOUNDS = ReachBoundOptions()
SELF_COLLISION_SAMPLES = SelfCollisionSampleOptions()
