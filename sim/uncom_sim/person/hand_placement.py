# SPDX-License-Identifier: Apache-2.0
"""Placement of a pointing hand such that it is seen which object is meant.

A person who wants to be understood brings the arm from where they stand, keeps clear of the objects on the table, does
not point across one object at another, and keeps the finger where the other one can see it.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation
from uncom_common.camera import PinholeCamera

from uncom_sim.person.hand_model import Hand, HandLandmark
from uncom_sim.person.options import HAND_MODEL, HAND_PLACEMENT, HandModelOptions, HandPlacementOptions
from uncom_sim.types import Table

FloatArray = npt.NDArray[np.float64]

# Directions in which an arm comes in, by the side where the person stands [rad], 0 pointing away from the robot.
ARM_AZIMUTH = {"far": np.pi, "left": -np.pi / 2.0, "right": np.pi / 2.0}


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """The one pointed for: camera and the pose (4, 4) of its optical frame in base_footprint."""

    camera: PinholeCamera
    pose: FloatArray

    def pixels(self, points: FloatArray) -> FloatArray:
        """Project points (N, 3) of base_footprint to pixels (N, 2)."""
        return self.camera.project((points - self.pose[:3, 3]) @ self.pose[:3, :3])


def robot_viewpoint() -> Viewpoint:
    """Return TIAGo's head camera as it looks at the table: torso 0.35 m up, head 0.95 rad down."""
    tilt = 0.95
    forward = np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    right = np.array([0.0, -1.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = (0.2429, 0.022, 1.3092)
    return Viewpoint(PinholeCamera(640, 480, 522.19, 522.19, 320.5, 240.5), pose)


@dataclass(frozen=True, slots=True)
class Obstacle:
    """An object on the table: middle (3,) and half the size (3,) of the upright box around it [m]."""

    middle: FloatArray
    half_size: FloatArray


@dataclass(frozen=True, slots=True)
class Placement:
    """A pose (4, 4) of the hand, the place (3,) pointed at, and how badly it would be understood (0 is perfect)."""

    pose: FloatArray
    target: FloatArray
    cost: float


def place_hand(
    hand: Hand,
    target: FloatArray,
    side: str,
    obstacles: Sequence[Obstacle],
    table: Table,
    viewpoint: Viewpoint,
    *,
    hand_model_options: HandModelOptions = HAND_MODEL,
    hand_placement_options: HandPlacementOptions = HAND_PLACEMENT,
) -> Placement:
    """Choose the best pose of a hand whose index line goes through a target (3,) [m], coming in from a side."""
    best: Placement | None = None
    for turn, pitch, distance in itertools.product(
        hand_placement_options.turns_rad, hand_placement_options.pitches_rad, hand_placement_options.distances_m
    ):
        azimuth = ARM_AZIMUTH[side] + turn
        direction = np.array([np.cos(azimuth) * np.cos(pitch), np.sin(azimuth) * np.cos(pitch), -np.sin(pitch)])
        pose = hand_pose(
            hand, target, direction, float(distance), viewpoint, hand_placement_options=hand_placement_options
        )
        cost = _posture_cost(float(turn), float(pitch), float(distance), float(direction[0]))
        if best is not None and cost >= best.cost:
            continue
        cost += _visibility_cost(hand, pose, target, obstacles, table, viewpoint, hand_model_options=hand_model_options)
        if best is None or cost < best.cost:
            best = Placement(pose, target, cost)
    if best is None:
        raise AssertionError
    return best


def hand_pose(
    hand: Hand,
    target: FloatArray,
    direction: FloatArray,
    distance: float,
    viewpoint: Viewpoint,
    *,
    hand_placement_options: HandPlacementOptions = HAND_PLACEMENT,
) -> FloatArray:
    """Return the pose (4, 4) with the index finger along a direction (3,), its tip at a distance [m] from a target."""
    to_camera = viewpoint.pose[:3, 3] - target
    up = np.array([0.0, 0.0, 1.0]) + 0.45 * to_camera / np.linalg.norm(to_camera)
    thumb_side = 1.0 if hand.handedness == "right" else -1.0
    turn = Rotation.from_rotvec(thumb_side * hand_placement_options.supination_rad * direction).as_matrix()
    rotation = turn @ _axes(direction, up) @ _axes(hand.pointing_axis, np.array([0.0, 0.0, 1.0])).T
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = target - distance * direction - rotation @ hand.joints[HandLandmark.INDEX_TIP]
    return pose


def _axes(forward: FloatArray, up: FloatArray) -> FloatArray:
    z = up - (up @ forward) * forward
    z /= np.linalg.norm(z)
    return np.column_stack([forward, np.cross(z, forward), z])


def _posture_cost(turn: float, pitch: float, distance: float, away: float) -> float:
    """Cost of a pose in itself; pointing away from the viewer hides the finger behind the hand."""
    low = abs(pitch - float(np.radians(34)))
    return 0.6 * abs(turn) + 0.8 * low + 1.5 * abs(distance - 0.14) + 1.5 * max(away, 0.0)


def _visibility_cost(
    hand: Hand,
    pose: FloatArray,
    target: FloatArray,
    obstacles: Sequence[Obstacle],
    table: Table,
    viewpoint: Viewpoint,
    *,
    hand_model_options: HandModelOptions = HAND_MODEL,
) -> float:
    joints = hand.joints @ pose[:3, :3].T + pose[:3, 3]
    arm = _arm_points(hand_model_options=hand_model_options) @ pose[:3, :3].T + pose[:3, 3]
    pixels = viewpoint.pixels(np.concatenate([joints, target[None]]))
    camera = viewpoint.camera
    margins = np.column_stack([pixels, camera.width - pixels[:, 0], camera.height - pixels[:, 1]]).min(axis=1)
    hidden = float(np.clip((35.0 - np.nan_to_num(margins[: len(HandLandmark)], nan=-500.0)) / 35.0, 0.0, 4.0).mean())
    finger = float(np.linalg.norm(pixels[HandLandmark.INDEX_TIP] - pixels[HandLandmark.INDEX_BASE]))
    depth = float(np.linalg.norm(joints[HandLandmark.INDEX_TIP] - viewpoint.pose[:3, 3]))
    full = (
        camera.fx
        * float(np.linalg.norm(hand.joints[HandLandmark.INDEX_TIP] - hand.joints[HandLandmark.INDEX_BASE]))
        / depth
    )
    foreshortened = float(np.clip(0.85 - finger / full, 0.0, 1.0))
    skeleton = np.concatenate([joints, arm])
    low = float(np.clip(table.height + 0.045 - _heights_over_table(skeleton, table), 0.0, 0.1).max()) / 0.03
    touching = _collision_cost(skeleton, obstacles)
    crossing = _occlusion_cost(pixels[HandLandmark.INDEX_TIP], pixels[len(HandLandmark)], target, obstacles, viewpoint)
    return 6.0 * hidden + 3.0 * foreshortened + 3.0 * low + 3.0 * touching + 1.5 * crossing


@functools.cache
def _arm_points(*, hand_model_options: HandModelOptions = HAND_MODEL) -> FloatArray:
    along = np.linspace(0.03, hand_model_options.forearm_m + 0.1, 8)
    return np.column_stack([-along, np.zeros(8), np.full(8, -0.03)])


def _heights_over_table(points: FloatArray, table: Table) -> FloatArray:
    """Heights of points; those beside the table count as high enough."""
    inside = (points[:, 0] < table.x_max) & (points[:, 1] > table.y_min) & (points[:, 1] < table.y_max)
    return np.where(inside, points[:, 2], np.inf)


def _collision_cost(points: FloatArray, obstacles: Sequence[Obstacle], clearance: float = 0.035) -> float:
    worst = 0.0
    for obj in obstacles:
        outside = np.maximum(np.abs(points - obj.middle) - obj.half_size, 0.0)
        worst = max(
            worst, float(np.clip(clearance - np.linalg.norm(outside, axis=1).min(), 0.0, clearance)) / clearance
        )
    return worst


def _occlusion_cost(
    tip: FloatArray, aim: FloatArray, target: FloatArray, obstacles: Sequence[Obstacle], viewpoint: Viewpoint
) -> float:
    """How much other objects lie between the finger and the target from the viewpoint (0 to 1)."""
    along = aim - tip
    worst = 0.0
    for obj in obstacles:
        if np.linalg.norm(obj.middle[:2] - target[:2]) < HAND_PLACEMENT.same_place_m:
            continue
        centre = viewpoint.pixels(obj.middle[None])[0]
        radius = (
            viewpoint.camera.fx * float(obj.half_size.max()) / float(np.linalg.norm(obj.middle - viewpoint.pose[:3, 3]))
        )
        share = float(np.clip((centre - tip) @ along / max(float(along @ along), 1e-9), 0.0, 1.0))
        gap = float(np.linalg.norm(tip + share * along - centre)) - radius
        worst = max(worst, float(np.clip((15.0 - gap) / 30.0, 0.0, 1.0)))
    return worst
