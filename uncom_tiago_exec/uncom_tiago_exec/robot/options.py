# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune the models of the robot: limits, reach, covers of shapes, distance maps and fingers."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class ArmGroupOptions:
    """Joint limits of a planning group, and how its reach is measured."""

    limit_inset_rad: float = tunable(
        0.004,
        unit="rad",
        meaning="distance of the planner's joint limits from the URDF's; of the torso a tenth of it, in metres",
    )
    reach_samples: int = tunable(1500, meaning="random configurations from which the reach of the wrist is measured")
    reach_slack_m: float = tunable(
        0.02, unit="m", meaning="allowance added to the reach, as samples do not hit the greatest distance"
    )


@dataclass(frozen=True, slots=True)
class ClearanceMapOptions:
    """Resolution and format of the maps of distances between links."""

    cells: int = tunable(128, meaning="cells of a map along each of its two joint axes")
    joints_between: int = tunable(2, meaning="joints between the two links of a pair that has a map: the axes of it")
    unit_m: float = tunable(
        0.001,
        unit="m",
        meaning="unit of the distances in the file, which holds them as bytes, row by row, zlib-compressed, in base64",
    )
    slack_m: float = tunable(
        0.0003, unit="m", meaning="allowance added to the displacement within a cell, for the sampled first joint"
    )
    lever_samples: int = tunable(
        256, meaning="angles of the second joint at which the lever arm about the first is measured"
    )


@dataclass(frozen=True, slots=True)
class ConvexCoverOptions:
    """How collision meshes are covered by convex bodies."""

    max_corners: int = tunable(32, meaning="greatest number of corners of a convex body")
    slack_m: float = tunable(1e-05, unit="m", meaning="allowance for the rounding of the numbers in the file")
    prism_sides: int = tunable(12, meaning="sides of the prism that encloses a cylinder")
    coarse_m: float = tunable(
        0.004, unit="m", meaning="radius at which a cover is good enough: links of torso, head and base"
    )
    arm_m: float = tunable(0.0018, unit="m", meaning="radius at which a cover is good enough: links 3 to 7 of an arm")
    shoulder_m: float = tunable(
        0.0008,
        unit="m",
        meaning="radius at which a cover is good enough: links 1 and 2 of an arm, which are always near the torso",
    )
    cut_shares: tuple[float, ...] = tunable(
        (0.3, 0.4, 0.5, 0.6, 0.7), meaning="positions of the cutting planes tried, as shares of the extent of a body"
    )
    cuts: int = tunable(3, meaning="greatest depth of successive cuts: at most eight bodies for a mesh")


@dataclass(frozen=True, slots=True)
class GripperOptions:
    """How the fingers of a gripper move."""

    reach_m: float = tunable(0.044, unit="m", meaning="travel of one finger", source="URDF of PAL's parallel gripper")
    speed_m_s: float = tunable(0.04, unit="m/s", meaning="speed of one finger")
    least_duration_s: float = tunable(0.3, unit="s", meaning="least duration of a motion of the fingers")


@dataclass(frozen=True, slots=True)
class ReachBoundOptions:
    """How far the shapes of the robot can get from a fixed line."""

    slack_m: float = tunable(0.002, unit="m", meaning="allowance added to the radius of every shape")


@dataclass(frozen=True, slots=True)
class SelfCollisionSampleOptions:
    """How the pairs of links that never or always touch are found."""

    samples: int = tunable(20000, meaning="random configurations that are checked")
    widest_range: float = tunable(
        10.0, meaning="range of a joint [rad, or m] above which it counts as unlimited and stays neutral"
    )
    always_share: float = tunable(
        0.95, meaning="share of configurations in collision above which a pair counts as touching always"
    )


ARM_GROUP = ArmGroupOptions()
CLEARANCE_MAP = ClearanceMapOptions()
CONVEX_COVERS = ConvexCoverOptions()
GRIPPER = GripperOptions()
REACH_BOUNDS = ReachBoundOptions()
SELF_COLLISION_SAMPLES = SelfCollisionSampleOptions()
