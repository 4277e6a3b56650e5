# SPDX-License-Identifier: Apache-2.0
"""Grasps of an object with a parallel gripper, found from its completed points alone.

Hands are proposed at points of the object (hand_proposals.py) and fitted to it: each goes as deep as it can and opens
as wide as its surroundings allow. The points between the pads give the width and, by their contacts, the quality
(antipodal grasps: Nguyen 1988; grasp_quality.py). Candidates whose fingers or palm meet points on the way are rejected.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.grasping.grasp_quality import HandAxes, PadContents, grasp_quality
from uncom_tiago_exec.grasping.hand_proposals import propose_hands
from uncom_tiago_exec.grasping.options import (
    GRASP_QUALITY,
    GRASP_SAMPLER,
    GraspQualityOptions,
    GraspSamplerOptions,
)
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.scene.object_shape import ObjectShape, downsample
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class Grasp:
    """A grasp of an object.

    Attributes:
        pose: of the grasping frame in base_footprint when the fingers close (4, 4).
        width: of the object between the pads [m].
        opening: gap between the fingers before they close [m].
        retreat: length of the straight approach [m].
        quality: from 0 to 1.
        family: "across" or "rim".
    """

    pose: FloatArray
    width: float
    opening: float
    retreat: float
    quality: float
    family: str

    @property
    def approach(self) -> FloatArray:
        """Unit direction (3,) in which the hand comes in."""
        return self.pose[:3, 0]


def grasp_candidates(
    shape: ObjectShape,
    others: FloatArray,
    gripper: GripperShape,
    count: int | None = None,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
    quality_options: GraspQualityOptions = GRASP_QUALITY,
) -> list[Grasp]:
    """Return grasps of an object, best first.

    Args:
        shape: of the object, in base_footprint.
        others: points (N, 3) of neighbours, which fingers and palm keep off.
        gripper: its dimensions.
        count: greatest number of grasps of each family; that of the options if None. It is limited by family as a
            task may allow one of them only.
        options: numbers that tune the proposals.
        quality_options: numbers that tune the quality.
    """
    count = options.max_per_family if count is None else count
    near = others
    if len(others):
        radius = 0.5 * float(np.linalg.norm(shape.size)) + options.neighbour_reach_m
        distances = np.linalg.norm(others[:, :2] - shape.middle[:2], axis=1)
        near = downsample(others[distances < radius], options.neighbour_voxel_m)
    found = []
    for hand, place, family in propose_hands(shape, options=options):
        grasp = _fit_grasp(shape, near, gripper, hand, place, family, options=options, quality_options=quality_options)
        if grasp is not None:
            found.append(grasp)
    found.sort(key=lambda g: -g.quality)
    kept, numbers = [], Counter[str]()
    for grasp in found:
        numbers[grasp.family] += 1
        if numbers[grasp.family] <= count:
            kept.append(grasp)
    return kept


def _fit_grasp(
    shape: ObjectShape,
    others: FloatArray,
    gripper: GripperShape,
    hand: HandAxes,
    place: FloatArray,
    family: str,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
    quality_options: GraspQualityOptions = GRASP_QUALITY,
) -> Grasp | None:
    """Return the grasp of a hand at a point (3,), as deep as it can go; None if the candidate is rejected."""
    frame = np.column_stack([hand.approach, hand.closing, hand.lateral])
    local = (shape.points - place) @ frame
    near = (others - place) @ frame if len(others) else np.zeros((0, 3))
    tip = _tip_depth(shape, gripper, hand, place, local, family, options=options)
    if tip is None:
        return None
    beside_pads = np.abs(local[:, 2]) <= gripper.half_width
    between = beside_pads & (local[:, 0] <= tip) & (local[:, 0] >= tip - (gripper.tip - gripper.palm))
    # the lower finger of a leaning hand keeps off the table
    clearances = options.finger_clearances_m[0 if hand.closing[2] == 0.0 else options.first_leaning_clearance :]
    for window in options.rim_windows_m if family == "rim" else (np.inf,):
        points = local[between & (np.abs(local[:, 1]) < window)]
        if len(points) < options.least_pad_points:
            return None
        low, high = float(points[:, 1].min()), float(points[:, 1].max())
        width, middle = high - low, 0.5 * (low + high)
        if width > gripper.open - options.opening_margin_m:
            return None
        opening = _widest_opening(local, near, gripper, tip, (low, high), clearances, options=options)
        if opening is not None:
            break
    else:
        return None
    contents = PadContents(points, tip, gripper.half_width, opening - width)
    quality = grasp_quality(shape, contents, hand, place, family, options=quality_options)
    pose = np.eye(4)
    pose[:3, :3] = frame
    pose[:3, 3] = place + hand.closing * middle + hand.approach * (tip - gripper.tip)
    passed = np.abs(local[:, 2]) <= gripper.half_width + options.retreat_side_m
    first = float(local[passed, 0].min())
    retreat = float(np.clip(tip - first + options.retreat_beyond_m, *options.retreat_range_m))
    return Grasp(pose, width, opening, retreat, quality, family)


def _widest_opening(
    local: FloatArray,
    near: FloatArray,
    gripper: GripperShape,
    tip: float,
    edges: tuple[float, float],
    clearances: tuple[float, ...],
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> float | None:
    """Return the gap of the fingers [m] with the first clearance at which they and the palm pass; None if none does.

    A wide opening allows for errors of the shape.

    Args:
        local: points of the object (N, 3) in the frame of the hand at the grasped point.
        near: points of neighbours (M, 3) in that frame.
        gripper: its dimensions.
        tip: where the finger tips end along the approach [m].
        edges: of the object between the pads, along the closing direction [m].
        clearances: added to its width [m].
        options: numbers that tune it.
    """
    width, middle = edges[1] - edges[0], 0.5 * (edges[0] + edges[1])
    for clearance in clearances:
        opening = min(gripper.open - options.open_slack_m, width + clearance)
        if not _is_blocked(local, near, gripper, tip, middle, opening, options=options):
            return opening
    return None


def _tip_depth(
    shape: ObjectShape,
    gripper: GripperShape,
    hand: HandAxes,
    place: FloatArray,
    local: FloatArray,
    family: str,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> float | None:
    """Return how far the finger tips go beyond `place` (3,) along the approach [m]; None if not far enough.

    local (N, 3): points of the object in the frame of the hand at that place.
    """
    depth = options.over_rim_m
    if family != "rim":
        past_widest = _widest_depth(local, gripper, options=options) + options.past_widest_m
        depth = max(options.least_past_middle_m, min(past_widest, options.past_middle_m))
    below_palm = (np.abs(local[:, 2]) <= gripper.body[1]) & (np.abs(local[:, 1]) <= gripper.body[0])
    if below_palm.any():
        if family == "across" and shape.rim is not None:
            depth = options.hollow_depth_m
        depth = min(depth, float(local[below_palm, 0].min()) + (gripper.tip - gripper.palm) - options.palm_gap_m)
    # distance of the lower corner of a pad below its middle
    corner, down = gripper.half_width * abs(float(hand.lateral[2])), -float(hand.approach[2])
    lower_finger = options.half_open_m * abs(float(hand.closing[2]))
    depth = min(depth, (place[2] - shape.bottom - corner - lower_finger - options.tip_clearance_m) / down)
    if family == "rim" and shape.rim is not None:
        depth = min(depth, (shape.rim.z - shape.rim.floor_z - corner - options.rim_floor_gap_m) / down)
        return depth if depth > options.least_depth_m else None
    # an oblique pad holds with its lower half what lies below the middle of its tip
    lower_half = options.shallow_pad_share * gripper.half_width * float(np.cos(hand.pitch)) + options.shallow_slack_m
    return depth if depth >= -min(options.shallow_height_share * shape.height, lower_half) else None


def _widest_depth(local: FloatArray, gripper: GripperShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> float:
    """Return how far along the approach points (N, 3) between the pads reach their greatest width [m]."""
    points = local[(np.abs(local[:, 2]) <= gripper.half_width) & (local[:, 0] <= options.past_middle_m)]
    if not len(points):
        return 0.0
    points = points[np.argsort(points[:, 0])]
    widths = np.maximum.accumulate(points[:, 1]) - np.minimum.accumulate(points[:, 1])
    return float(points[int(np.searchsorted(widths, options.widest_share * widths[-1])), 0])


def _is_blocked(
    local: FloatArray,
    near: FloatArray,
    gripper: GripperShape,
    tip: float,
    middle: float,
    opening: float,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> bool:
    """Tell whether open fingers or palm, coming in along the approach, meet the object itself or a neighbour.

    Args:
        local: points of the object (N, 3) in the frame of the hand at the grasped point.
        near: points of neighbours (M, 3) in that frame.
        gripper: its dimensions.
        tip: where the finger tips end along the approach [m].
        middle: of the fingers along the closing direction [m].
        opening: gap between the fingers [m].
        options: numbers that tune it.
    """
    for points, clearance in ((local, 0.0), (near, options.side_clearance_m)):
        if not len(points):
            continue
        ahead = points[:, 0] < tip + clearance
        beside = np.abs(points[:, 2]) < gripper.half_width + clearance
        offset = np.abs(points[:, 1] - middle)
        inset = options.self_overlap_m if clearance == 0.0 else -clearance
        outside = opening / 2.0 + gripper.thickness + max(clearance, 0.0)
        fingers = (offset > opening / 2.0 + inset) & (offset < outside)
        if (ahead & beside & fingers).any():
            return True
        palm_front = tip - (gripper.tip - gripper.palm) + options.palm_clearance_m + clearance
        palm = (points[:, 0] < palm_front) & (np.abs(points[:, 2]) < gripper.body[1] + clearance)
        if (palm & (offset < gripper.body[0] + clearance)).any():
            return True
    return False
