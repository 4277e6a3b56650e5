# SPDX-License-Identifier: Apache-2.0
"""Quality of a grasp, from 0 to 1, judged by the points between the pads.

It is a product of factors: how well the contacts face each other (two fingers hold an object by friction if the line
between the contacts lies in the friction cones of both, an antipodal grasp: Nguyen 1988), size of the contacts, depth
between the fingers, width, lever arm of the weight, direction of approach, height, and clearance of the open fingers.

Points are in the frame of the hand at the grasped point: approach, closing, lateral [m].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.grasping.options import GRASP_QUALITY, GraspQualityOptions
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.options import SHAPE_COMPLETION
from uncom_tiago_exec.types import FloatArray

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, slots=True)
class HandAxes:
    """Orientation of a hand.

    Attributes:
        approach: unit direction (3,) in base_footprint in which the hand comes in, x of the grasping frame.
        closing: unit direction (3,) in which the fingers close, y of the grasping frame.
        lateral: unit direction (3,) across the pads, z of the grasping frame.
        pitch: of the approach below the horizontal, before the hand leans [rad].
    """

    approach: FloatArray
    closing: FloatArray
    lateral: FloatArray
    pitch: float


@dataclass(frozen=True, slots=True)
class PadContents:
    """What is between the pads.

    Attributes:
        points: of the object (N, 3), in the frame of the hand at the grasped point.
        tip: where the finger tips end along the approach, from the grasped point [m].
        half_width: half the width of a pad [m].
        clearance: by how much the open fingers are wider apart than the points [m].
    """

    points: FloatArray
    tip: float
    half_width: float
    clearance: float


def grasp_quality(
    shape: ObjectShape,
    contents: PadContents,
    hand: HandAxes,
    place: FloatArray,
    family: str,
    *,
    options: GraspQualityOptions = GRASP_QUALITY,
) -> float:
    """Return the quality of a grasp.

    Args:
        shape: of the object.
        contents: points between the pads.
        hand: its orientation.
        place: grasped point (3,) in base_footprint.
        family: "across" (the body) or "rim".
        options: numbers that tune it.
    """
    # fingers that hardly pass the object may touch its edge
    spare = (contents.clearance - options.width_error_m) / options.clearance_scale_m
    clearance = float(np.clip(spare, options.least_clearance_factor, 1.0))
    quality = _contact_quality(shape, contents, hand, place, options=options) * clearance
    if family == "across":
        taper = _taper_at_pad_ends(contents, options=options) / options.slip_taper
        return quality * float(np.clip(1.0 - taper, options.least_taper_factor, 1.0))
    steepness = float(np.sin(hand.pitch) ** options.rim_pitch_exponent)
    visibility = _edge_visibility(shape, place, options=options)
    return (
        options.rim_factor
        * quality
        * steepness
        * visibility
        * _weight_factor(shape, place, contents.tip, options=options)
    )


def _contact_quality(
    shape: ObjectShape,
    contents: PadContents,
    hand: HandAxes,
    place: FloatArray,
    *,
    options: GraspQualityOptions = GRASP_QUALITY,
) -> float:
    """Return the product of the factors of contacts, width, depth, lever arm of the weight, approach and height."""
    points = contents.points
    low, high = float(points[:, 1].min()), float(points[:, 1].max())
    left = points[points[:, 1] < low + options.contact_depth_m]
    right = points[points[:, 1] > high - options.contact_depth_m]
    # contacts at different places of the two pads turn the object
    slant = np.linalg.norm(left[:, [0, 2]].mean(axis=0) - right[:, [0, 2]].mean(axis=0))
    facing = float(np.exp(-((slant / max(high - low, options.slant_width_m)) ** 2) * options.slant_weight))
    patch = min(float(np.ptp(left[:, 2])), float(np.ptp(right[:, 2]))) + options.patch_length_weight * min(
        float(np.ptp(left[:, 0])), float(np.ptp(right[:, 0]))
    )
    contact = min(1.0, options.least_contact_factor + patch / options.patch_scale_m)
    inside = max(0.0, contents.tip - float(points[:, 0].min()))
    depth = min(1.0, options.least_depth_factor + inside / options.depth_scale_m)
    width = (
        1.0
        if high - low < options.easy_width_m
        else max(options.least_width_factor, 1.0 - (high - low - options.easy_width_m) / options.width_scale_m)
    )
    middle = shape.middle
    arm = np.array([place[0] - middle[0], place[1] - middle[1]])
    from_pad_line = float(np.linalg.norm(arm - (arm @ hand.closing[:2]) * hand.closing[:2]))
    leverage = float(
        np.exp(-from_pad_line / options.lever_scale_m) * np.exp(-float(np.linalg.norm(arm)) / options.offset_scale_m)
    )
    approach = options.approach_factor + options.approach_pitch_gain * np.sin(hand.pitch)
    return float(
        facing * contact * depth * width * leverage * approach * _height_factor(place[2] - middle[2], options=options)
    )


def _height_factor(height: float, *, options: GraspQualityOptions = GRASP_QUALITY) -> float:
    """Return the factor of a grasp at a height above the object's centre [m].

    An object held a little above its centre does not tip over, far above it swings.
    """
    factor = float(np.clip(1.0 + height / options.height_scale_m, *options.height_factors))
    return factor / (1.0 + options.swing_weight * max(0.0, height - options.swing_height_m))


def _taper_at_pad_ends(contents: PadContents, *, options: GraspQualityOptions = GRASP_QUALITY) -> float:
    """Return by how much the object widens to one side per length where the pads end; 0 if it narrows everywhere.

    Pads that end before the widest place press the object out from between them.
    """
    points = contents.points
    steepest, widest = 0.0, float(np.ptp(points[:, 1])) - 0.5 * SHAPE_COMPLETION.voxel_m
    ends = (points[:, 0], contents.tip), (points[:, 2], contents.half_width), (-points[:, 2], contents.half_width)
    for along, end in ends:
        last = along > end - options.pad_end_m
        before = (along > end - 2.0 * options.pad_end_m) & (along <= end - options.pad_end_m)
        if min(np.count_nonzero(last), np.count_nonzero(before)) <= 1:
            continue
        width = float(np.ptp(points[last, 1]))
        if width >= widest:
            steepest = max(steepest, 0.5 * (width - float(np.ptp(points[before, 1]))) / options.pad_end_m)
    return steepest


def _edge_visibility(shape: ObjectShape, place: FloatArray, *, options: GraspQualityOptions = GRASP_QUALITY) -> float:
    """Return the factor of an edge at a point (3,): less than 1 on the side whose outside the camera does not see."""
    view = shape.middle[:2] / max(float(np.linalg.norm(shape.middle[:2])), 1e-6)
    outward = place[:2] - shape.middle[:2]
    hidden = max(0.0, float(outward @ view) / max(float(np.linalg.norm(outward)), 1e-6))
    return float(1.0 - options.hidden_edge_loss * hidden)


def _weight_factor(
    shape: ObjectShape, place: FloatArray, depth: float, *, options: GraspQualityOptions = GRASP_QUALITY
) -> float:
    """Return the factor of a grasp at a rim: less than 1 where the weight of the object turns it in the fingers.

    The moment of the weight about the grasped point (3,) has to be borne by a couple of forces: of one pad at the edge
    and of the other one `depth` [m] below it. The weight is that of the surface, as of dishes.
    """
    centre = shape.points.mean(axis=0)
    weight = options.sheet_kg_m2 * GRAVITY_M_S2 * len(shape.points) * SHAPE_COMPLETION.voxel_m**2
    moment = weight * float(np.linalg.norm(place[:2] - centre[:2]))
    return min(1.0, options.pad_force_n * max(depth, 0.0) / max(moment, 1e-6)) ** 2
