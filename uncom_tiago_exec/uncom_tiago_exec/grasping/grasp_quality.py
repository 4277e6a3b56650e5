# SPDX-License-Identifier: Apache-2.0
"""How well an object would be held, from 0 to 1, by the points between the pads.

Points are in the frame of the hand at the place it takes: approach, closing, lateral [m].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.grasping.options import GRASP_QUALITY, GraspQualityOptions
from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.options import SHAPE_COMPLETION
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class HandAxes:
    """A hand's axes: approach, closing, lateral, each (3,), and pitch below the horizontal [rad]."""

    approach: FloatArray
    closing: FloatArray
    lateral: FloatArray
    pitch: float


@dataclass(frozen=True, slots=True)
class PadContents:
    """What is between the pads: points (N, 3), where the tips end along the approach, half the pads' width [m].

    room: by how much the fingers open wider than it is [m].
    """

    points: FloatArray
    tip: float
    half_width: float
    room: float


def grasp_quality(
    shape: ObjectShape,
    contents: PadContents,
    hand: HandAxes,
    place: FloatArray,
    family: str,
    *,
    options: GraspQualityOptions = GRASP_QUALITY,
) -> float:
    """Judge a grasp of a family ("across" or "rim") at a place (3,) between the pads."""
    passes = float(
        np.clip((contents.room - options.width_error_m) / 0.015, 0.4, 1.0)
    )  # fingers that just pass touch its edge
    quality = _contact_quality(shape, contents, hand, place, options=options) * passes
    if family == "across":
        return quality * float(
            np.clip(1.0 - _taper_at_pad_ends(contents, options=options) / options.slip_taper, 0.2, 1.0)
        )
    steep = float(np.sin(hand.pitch) ** 1.5)
    return (
        0.85
        * quality
        * steep
        * _visibility_of_edge(shape, place)
        * _share_of_weight_borne(shape, place, contents.tip, options=options)
    )


def _contact_quality(
    shape: ObjectShape,
    contents: PadContents,
    hand: HandAxes,
    place: FloatArray,
    *,
    options: GraspQualityOptions = GRASP_QUALITY,
) -> float:
    """Judge contact patches, width, depth, leverage of the weight and approach."""
    span = contents.points
    low, high = float(span[:, 1].min()), float(span[:, 1].max())
    left, right = span[span[:, 1] < low + options.contact_depth_m], span[span[:, 1] > high - options.contact_depth_m]
    # both pads should meet at one place of the fingers, else they turn the object
    slant = np.linalg.norm(left[:, [0, 2]].mean(axis=0) - right[:, [0, 2]].mean(axis=0))
    facing = float(np.exp(-((slant / max(high - low, 0.012)) ** 2) * 2.0))
    patch = min(float(np.ptp(left[:, 2])), float(np.ptp(right[:, 2]))) + 0.5 * min(
        float(np.ptp(left[:, 0])), float(np.ptp(right[:, 0]))
    )
    contact = min(1.0, 0.3 + patch / 0.03)
    depth = min(1.0, 0.4 + max(0.0, contents.tip - float(span[:, 0].min())) / 0.025)
    width = 1.0 if high - low < options.easy_width_m else max(0.3, 1.0 - (high - low - options.easy_width_m) / 0.035)
    # distance of the weight's middle from the line between the pads
    middle = shape.middle
    arm = np.array([place[0] - middle[0], place[1] - middle[1]])
    across = float(np.linalg.norm(arm - (arm @ hand.closing[:2]) * hand.closing[:2]))
    leverage = float(np.exp(-across / 0.08) * np.exp(-float(np.linalg.norm(arm)) / 0.4))
    approach = 0.8 + 0.2 * np.sin(hand.pitch)
    higher = float(place[2] - middle[2])  # held a little above its middle it does not tip, far above it swings
    above = float(np.clip(1.0 + higher / 0.25, 0.7, 1.05)) / (1.0 + 4.0 * max(0.0, higher - 0.04))
    return float(facing * contact * depth * width * leverage * approach * above)


def _taper_at_pad_ends(contents: PadContents, *, options: GraspQualityOptions = GRASP_QUALITY) -> float:
    """Return how much wider to a side objects get per length where the pads end.

    Pads that end before the widest place press an object out from between them.
    """
    span = contents.points
    steepest, widest = 0.0, float(np.ptp(span[:, 1])) - 0.5 * SHAPE_COMPLETION.voxel_m
    sides = (span[:, 0], contents.tip), (span[:, 2], contents.half_width), (-span[:, 2], contents.half_width)
    for along, end in sides:
        last, before = (
            along > end - options.pad_end_m,
            (along > end - 2.0 * options.pad_end_m) & (along <= end - options.pad_end_m),
        )
        if min(np.count_nonzero(last), np.count_nonzero(before)) <= 1:
            continue
        width = float(np.ptp(span[last, 1]))
        if width >= widest:
            steepest = max(steepest, 0.5 * (width - float(np.ptp(span[before, 1]))) / options.pad_end_m)
    return steepest


def _visibility_of_edge(shape: ObjectShape, place: FloatArray) -> float:
    """Return less than 1 for an edge on the far side, whose outside (a handle, perhaps) the camera does not see."""
    view = shape.middle[:2] / max(float(np.linalg.norm(shape.middle[:2])), 1e-6)
    outward = place[:2] - shape.middle[:2]
    return float(1.0 - 0.4 * max(0.0, float(outward @ view) / max(float(np.linalg.norm(outward)), 1e-6)))


def _share_of_weight_borne(
    shape: ObjectShape, place: FloatArray, depth: float, *, options: GraspQualityOptions = GRASP_QUALITY
) -> float:
    """Return less than 1 where the weight beside the fingers would turn the object out of them.

    It is held level by one pad pressing at the edge and the other `depth` [m] below.
    """
    middle = shape.points.mean(axis=0)
    weight = options.sheet_kg_m2 * 9.81 * len(shape.points) * SHAPE_COMPLETION.voxel_m**2
    moment = weight * float(np.linalg.norm(place[:2] - middle[:2]))
    return min(1.0, options.pad_force_n * max(depth, 0.0) / max(moment, 1e-6)) ** 2
