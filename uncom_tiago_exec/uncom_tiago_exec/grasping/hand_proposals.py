# SPDX-License-Identifier: Apache-2.0
"""Proposals of hands: orientations, and points of an object at which they may grasp it.

A hand closes horizontally (y of the grasping frame) and comes in (x of the grasping frame) from above or obliquely. Two
families are proposed: "across" the body, and at the "rim" of a hollow object with one finger inside; at a sloping wall
the hand may lean with it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from uncom_tiago_exec.grasping.grasp_quality import HandAxes
from uncom_tiago_exec.grasping.options import GRASP_SAMPLER, GraspSamplerOptions
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.types import FloatArray


def _hand_axes(pitch_deg: float, yaw: float, lean: float = 0.0) -> HandAxes:
    """Return the axes of a hand.

    Args:
        pitch_deg: of the approach below the horizontal [deg].
        yaw: of the approach about the vertical [rad].
        lean: turn about the lateral axis [rad], after which the closing direction points down.
    """
    pitch = np.radians(pitch_deg)
    approach = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)])
    closing = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    cos, sin = np.cos(lean), np.sin(lean)
    approach, closing = cos * approach - sin * closing, cos * closing + sin * approach
    return HandAxes(approach, closing, np.cross(approach, closing), float(pitch))


def propose_hands(
    shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER
) -> Iterator[tuple[HandAxes, FloatArray, str]]:
    """Yield hands, points to grasp (3,) in base_footprint, and families."""
    yaws = list(np.radians(np.arange(-180.0, 180.0, options.yaw_step_deg)))
    slope = _wall_slope(shape, options=options)
    if shape.axis is None:
        yaws += [shape.yaw + k * np.pi / 2.0 for k in range(4)]
    for pitch in options.pitches_deg:
        for yaw in yaws:
            hand = _hand_axes(pitch, float(yaw))
            if shape.rim is not None and shape.rim.z - shape.bottom > options.low_rim_m:
                for sign in (-1.0, 1.0):
                    edge = shape.rim.centre + sign * (shape.rim.radius - options.rim_inset_m) * hand.closing[:2]
                    place = np.array([edge[0], edge[1], shape.rim.z])
                    yield hand, place, "rim"
                    if slope > options.upright_wall_rad and pitch in options.wall_pitches_deg:
                        yield _hand_axes(pitch, float(yaw), sign * slope), place, "rim"
            for place in _places_across_body(shape, options=options):
                yield hand, place, "across"


def _wall_slope(shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> float:
    """Return the slope of the wall below a rim, outwards from the vertical [rad]; 0 if too little of it is visible.

    Pads lie flat on the wall if the hand leans by that angle.
    """
    rim = shape.rim
    if rim is None:
        return 0.0
    radius, z = np.linalg.norm(shape.visible[:, :2] - rim.centre, axis=1), shape.visible[:, 2]
    wall = (z > max(rim.z - options.wall_depth_m, rim.floor_z + options.wall_floor_m)) & (
        np.abs(radius / rim.radius - options.wall_radius_share) < options.wall_radius_tolerance
    )
    if int(np.count_nonzero(wall)) < options.few_points or float(np.ptp(z[wall])) < options.least_wall_height_m:
        return 0.0
    return float(np.clip(np.arctan(np.polyfit(z[wall], radius[wall], 1)[0]), 0.0, options.max_lean_rad))


def _places_across_body(shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> Iterator[FloatArray]:
    """Yield points (3,) inside the body, in base_footprint, at which it can be grasped."""
    middle = shape.middle
    levels = (options.middle_level,) if shape.height < options.low_object_m else options.body_levels
    for level in levels:
        z = shape.bottom + level * shape.height
        yield np.array([middle[0], middle[1], z])
    if shape.axis is None and shape.size[0] > options.long_object_m:
        along = np.array([np.cos(shape.yaw), np.sin(shape.yaw)])
        for share in options.long_shares:
            xy = middle[:2] + share * shape.size[0] * along
            yield np.array([xy[0], xy[1], shape.bottom + options.middle_level * shape.height])
