# SPDX-License-Identifier: Apache-2.0
"""Numbers of the simulated world."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.tunables import tunable


@dataclass(frozen=True, slots=True)
class PhysicsOptions:
    """PyBullet's settings, and how objects are put into its world."""

    gravity_m_s2: float = tunable(-9.81, unit="m/s^2", meaning="acceleration along the vertical")
    drop_m: float = tunable(0.0015, unit="m", meaning="height above the table from which objects are let down")
    hidden_place_m: tuple[float, float, float] = tunable(
        (0.0, 0.0, -20.0), unit="m", meaning="where the hand is while it is away"
    )
    contact_steps: int = tunable(4, meaning="physics steps from one look at the contacts to the next")
    solver_iterations: int = tunable(
        150,
        meaning="iterations of the constraint solver; with 50 what is held creeps between the pads by 1 to 2 degrees/s",
    )
    contact_breaking_m: float = tunable(
        0.001, unit="m", meaning="slide after which a contact is made anew; old ones keep normals that are long wrong"
    )
    contact_gap_s: float = tunable(0.25, unit="s", meaning="touches closer together than this are one")


@dataclass(frozen=True, slots=True)
class SceneVariationOptions:
    """How a seed changes a scene, and what must still hold."""

    mirrored_share: float = tunable(0.5, meaning="share of the scenes whose left and right are exchanged")
    picture_margin_px: float = tunable(
        8.0, unit="px", meaning="least distance of a visible object from the edge of the picture"
    )
    sight_gap_m: float = tunable(0.005, unit="m", meaning="gap between the line of sight and an object beside it")
    shift_m: float = tunable(0.06, unit="m", meaning="greatest shift along x and along y")
    turn_rad: float = tunable(0.6, unit="rad", meaning="greatest turn about the vertical")
    gap_m: float = tunable(0.04, unit="m", meaning="least gap between two outlines: room for two fingers")
    reach_x_m: tuple[float, float] = tunable(
        (0.50, 0.72), unit="m", meaning="range of x of what is to be moved and where it is to go"
    )
    reach_y_m: float = tunable(0.40, unit="m", meaning="greatest |y| of the same")
    free_radius_m: float = tunable(
        0.10, unit="m", meaning="least distance of other objects from a place where something is to go"
    )
    attempts: int = tunable(2000, meaning="arrangements that are tried")
    beside_m: float = tunable(0.17, unit="m", meaning="distance from a target at which a place beside it is kept free")


@dataclass(frozen=True, slots=True)
class PlacementOptions:
    """What objects of a scene file may do to one another and the table."""

    overlap_m2: float = tunable(2e-6, unit="m^2", meaning="area that two outlines may share")
    edge_m: float = tunable(0.01, unit="m", meaning="how near to the edge of the table an object's middle may be")


@dataclass(frozen=True, slots=True)
class TableLimits:
    """What tables a scene file may have."""

    side_m: tuple[float, float] = tunable((0.2, 4.0), unit="m", meaning="least and greatest length of a side")
    height_m: tuple[float, float] = tunable((0.3, 1.1), unit="m", meaning="least and greatest height")
    nearest_x_m: float = tunable(0.3, unit="m", meaning="nearest edge, so that the robot does not stand in the table")


@dataclass(frozen=True, slots=True)
class RoomOptions:
    """Table legs, floor and materials of the room."""

    top_thickness_m: float = tunable(0.035, unit="m", meaning="thickness of the table top")
    leg_m: float = tunable(0.05, unit="m", meaning="width of a table leg")
    half_size_m: float = tunable(6.0, unit="m", meaning="half the width of the floor")
    woods: tuple[tuple[float, float, float], ...] = tunable(
        ((0.66, 0.52, 0.37), (0.60, 0.45, 0.31), (0.71, 0.59, 0.45), (0.55, 0.43, 0.33)),
        meaning="colours of table tops (red, green, blue from 0 to 1), dull as those of real rooms",
    )
    walls: tuple[tuple[float, float, float], ...] = tunable(
        ((0.80, 0.81, 0.80), (0.77, 0.80, 0.82), (0.82, 0.79, 0.74)), meaning="colours of walls"
    )
    floors: tuple[tuple[float, float, float], ...] = tunable(
        ((0.45, 0.45, 0.46), (0.52, 0.50, 0.47), (0.40, 0.42, 0.44)), meaning="colours of floors"
    )


@dataclass(frozen=True, slots=True)
class MicrophoneOptions:
    """What the microphone hears of a quiet room."""

    room_noise: float = tunable(6.0, meaning="standard deviation of the noise in 16-bit steps")


PHYSICS = PhysicsOptions()
SCENE_VARIATION = SceneVariationOptions()
PLACEMENT = PlacementOptions()
TABLE_LIMITS = TableLimits()
ROOM = RoomOptions()
MICROPHONE = MicrophoneOptions()
