# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune execution: driving, gripping, recovery and the search from nearer."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class BaseApproachOptions:
    """When and how far the base drives nearer."""

    distances_m: tuple[float, ...] = tunable(
        (0.06, 0.12), unit="m", meaning="distances that the base may drive nearer, in the order in which they are tried"
    )
    front_m: float = tunable(
        0.30, unit="m", meaning="distance from base_footprint to the front of the base, with some room"
    )
    put_back_places: int = tunable(
        5, meaning="places that are tried to put back what is held: where it was, and some at the middle of the table"
    )
    doubtful_quality: float = tunable(
        0.2, meaning="grasp quality up to which a short drive to a better grasp is worth its time"
    )
    better_ratio: float = tunable(2.0, meaning="times as good a grasp must be to be worth a drive, or a longer one")
    held_check_step_m: float = tunable(
        0.02, unit="m", meaning="distance along a drive between two checks that what is held meets nothing"
    )


@dataclass(frozen=True, slots=True)
class BaseDriveOptions:
    """The velocity profile of a short straight drive, and when the base counts as back."""

    speed_mps: float = tunable(0.12, unit="m/s", meaning="greatest velocity")
    least_speed_mps: float = tunable(0.008, unit="m/s", meaning="least velocity before the end")
    gain_per_s: float = tunable(2.5, unit="1/s", meaning="velocity per remaining distance: the end is driven slowly")
    tolerance_m: float = tunable(0.002, unit="m", meaning="remaining distance that counts as none")
    displaced_m: float = tunable(
        0.05, unit="m", meaning="distance from where it began beyond which others moved the base: it begins anew there"
    )


@dataclass(frozen=True, slots=True)
class GripOptions:
    """How fingers hold, and what their gap tells."""

    squeeze_m: float = tunable(
        0.03,
        unit="m",
        meaning="by how much less than the width of the object the fingers aim, so that they keep pressing; with less, "
        "a pair that a load moved aside comes to a stop where one finger presses alone",
    )
    stuck_m: float = tunable(
        0.01, unit="m", meaning="fingers that open by this much less than told still hold what they had"
    )
    freed_m: float = tunable(
        0.012,
        unit="m",
        meaning="fingers that open by at least this much let go, though something beside them is in their way",
    )
    release_retries: int = tunable(3, meaning="times that stuck fingers close and open again")
    slipped_m: float = tunable(
        0.014, unit="m", meaning="fingers that close further by this much have lost what was between them"
    )
    empty_gap_m: float = tunable(0.002, unit="m", meaning="gap below which closed fingers hold nothing")
    empty_width_ratio: float = tunable(0.3, meaning="the same as a share of the width of the object")


@dataclass(frozen=True, slots=True)
class PlanExecutionOptions:
    """What a motion may differ from its plan by."""

    start_deviation: float = tunable(
        0.15, unit="rad or m", meaning="distance of a joint from the start of a motion beyond which it is not begun"
    )
    early_contact_m: float = tunable(
        0.035,
        unit="m",
        meaning="distance before its place at which a lowered object may come to rest: it hangs lower than thought "
        "where it turned between the fingers",
    )
    early_contact_radius_ratio: float = tunable(
        0.7, meaning="the same for a dish held by its edge, as a share of its radius"
    )


@dataclass(frozen=True, slots=True)
class RecoveryOptions:
    """The way home from wherever an arm was left."""

    retreats_m: tuple[float, ...] = tunable(
        (0.1, 0.06, 0.03), unit="m", meaning="lengths of straight ways out of the objects that are tried, in this order"
    )
    near_motion: float = tunable(
        0.15, unit="rad or m", meaning="distance from its last motion up to which an arm can go on along it"
    )
    home_tolerance: float = tunable(0.02, unit="rad or m", meaning="distance from home that counts as there")
    no_motion: float = tunable(1e-3, unit="rad or m", meaning="distance that is too short for a motion")
    turn_deg: float = tunable(
        50.0, unit="deg", meaning="lean beyond which a held object turns about the line between the finger pads"
    )
    lever_m: float = tunable(
        0.03, unit="m", meaning="distance of its middle from the finger pads up to which it does not turn"
    )
    away: float = tunable(0.05, unit="rad or m", meaning="distance from home beyond which an arm was left elsewhere")
    speed_scale: float = tunable(0.5, meaning="speed of the way home, as a share of the usual one")
    retreat_speed_scale: float = tunable(0.4, meaning="speed of the straight way out, as a share of the usual one")
    table_step_m: float = tunable(
        0.003, unit="m", meaning="by how much lower a table is taken to be at a time where the hand stands in it"
    )
    table_steps: int = tunable(5, meaning="how often it is lowered at most")


BASE_APPROACH = BaseApproachOptions()
BASE_DRIVE = BaseDriveOptions()
GRIP = GripOptions()
PLAN_EXECUTION = PlanExecutionOptions()
RECOVERY = RecoveryOptions()
