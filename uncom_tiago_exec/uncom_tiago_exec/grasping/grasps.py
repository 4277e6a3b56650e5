# SPDX-License-Identifier: Apache-2.0
"""Where and how to take an object with a parallel gripper, from its completed points alone.

A candidate closes horizontally (y of the grasping frame) and comes in (x of the grasping frame) from above or
obliquely. Around solid objects it is placed across the body, on hollow objects over the edge of the opening. The points
between the pads give width, contact patches and how well they face each other (antipodal: Nguyen 1988); points in the
way of fingers or palm rule it out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.grasping.grasp_quality import HandAxes, PadContents, grasp_quality
from uncom_tiago_exec.grasping.options import GRASP_SAMPLER, GraspSamplerOptions
from uncom_tiago_exec.robot.gripper_shape import GripperShape
from uncom_tiago_exec.scene.object_shape import ObjectShape, thin
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class Grasp:
    """A way to take an object.

    pose (4, 4): grasping frame in base_footprint when the fingers close; width: of what is between the pads;
    opening: of the fingers before; retreat: how far to come from along the approach [m]; quality 0 to 1.
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
    count: int = 120,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> list[Grasp]:
    """Return up to `count` grasps of each family, best first; fingers keep off others (N, 3), the neighbours."""
    near = others
    if len(others):
        reach = 0.5 * float(np.linalg.norm(shape.size)) + 0.2
        near = thin(others[np.linalg.norm(others[:, :2] - shape.middle[:2], axis=1) < reach], 0.007)
    found = []
    for hand, place, family in _hand_proposals(shape, options=options):
        grasp = _fit_grasp(shape, near, gripper, hand, place, family, options=options)
        if grasp is not None:
            found.append(grasp)
    found.sort(key=lambda g: -g.quality)
    kept, taken = [], Counter[str]()
    for grasp in found:  # of each family: what is to be poured is of no use in a hand over its edge
        taken[grasp.family] += 1
        if taken[grasp.family] <= count:
            kept.append(grasp)
    return kept


def _hand_axes(pitch_deg: float, yaw: float, lean: float = 0.0) -> HandAxes:
    """Return a hand; leaning [rad] it comes in against its closing direction, which then points down."""
    pitch = np.radians(pitch_deg)
    approach = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)])
    closing = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    cos, sin = np.cos(lean), np.sin(lean)
    approach, closing = cos * approach - sin * closing, cos * closing + sin * approach
    return HandAxes(approach, closing, np.cross(approach, closing), float(pitch))


def _hand_proposals(
    shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER
) -> Iterator[tuple[HandAxes, FloatArray, str]]:
    """Yield hands and the points between their pads."""
    yaws = list(np.radians(np.arange(-180.0, 180.0, 22.5)))
    slope = _wall_slope(shape, options=options)
    if shape.axis is None:
        yaws += [shape.yaw + k * np.pi / 2.0 for k in range(4)]
    for pitch in options.pitches_deg:
        for yaw in yaws:
            hand = _hand_axes(pitch, float(yaw))
            if shape.rim is not None and shape.rim.z - shape.bottom > options.low_rim_m:
                for sign in (-1.0, 1.0):
                    edge = shape.rim.centre + sign * (shape.rim.radius - 0.004) * hand.closing[:2]
                    place = np.array([edge[0], edge[1], shape.rim.z])
                    yield hand, place, "rim"
                    if slope > options.upright_wall_rad and pitch in options.wall_pitches_deg:
                        yield _hand_axes(pitch, float(yaw), sign * slope), place, "rim"
            for place in _places_across_body(shape, options=options):
                yield hand, place, "across"


def _wall_slope(shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> float:
    """Return by how much the wall under the rim leans outwards [rad]: pads lie flat on it when the hand leans too."""
    rim = shape.rim
    if rim is None:
        return 0.0
    radius, z = np.linalg.norm(shape.visible[:, :2] - rim.centre, axis=1), shape.visible[:, 2]
    wall = (z > max(rim.z - 0.03, rim.floor_z + 0.008)) & (
        np.abs(radius / rim.radius - options.wall_radius_share) < options.wall_radius_tolerance
    )
    if int(np.count_nonzero(wall)) < options.few_points or float(np.ptp(z[wall])) < options.least_wall_height_m:
        return 0.0
    return float(np.clip(np.arctan(np.polyfit(z[wall], radius[wall], 1)[0]), 0.0, options.max_lean_rad))


def _places_across_body(shape: ObjectShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> Iterator[FloatArray]:
    """Yield points inside the body at which to grip it."""
    middle = shape.middle
    levels = (0.5,) if shape.height < options.low_object_m else (0.35, 0.55, 0.75, 0.88)
    for level in levels:
        z = shape.bottom + level * shape.height
        yield np.array([middle[0], middle[1], z])
    if shape.axis is None and shape.size[0] > options.long_object_m:
        along = np.array([np.cos(shape.yaw), np.sin(shape.yaw)])
        for share in (-0.3, -0.15, 0.15, 0.3):
            xy = middle[:2] + share * shape.size[0] * along
            yield np.array([xy[0], xy[1], shape.bottom + 0.5 * shape.height])


def _fit_grasp(
    shape: ObjectShape,
    others: FloatArray,
    gripper: GripperShape,
    hand: HandAxes,
    place: FloatArray,
    family: str,
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> Grasp | None:
    """Place the hand at a point as deep as it can go, and judge it; None if something is in the way."""
    frame = np.column_stack([hand.approach, hand.closing, hand.lateral])
    local = (shape.points - place) @ frame
    near = (others - place) @ frame if len(others) else np.zeros((0, 3))
    tip = _tip_depth(shape, gripper, hand, place, local, family, options=options)
    if tip is None:
        return None
    low_limit = tip - (gripper.tip - gripper.palm)
    padded = (np.abs(local[:, 2]) <= gripper.half_width) & (local[:, 0] <= tip) & (local[:, 0] >= low_limit)
    # an edge that slopes inwards, as a plate's, needs the inner finger further in
    for window in (0.022, 0.034, 0.044) if family == "rim" else (np.inf,):
        span = local[padded & (np.abs(local[:, 1]) < window)]
        if len(span) < options.least_pad_points:
            return None
        low, high = float(span[:, 1].min()), float(span[:, 1].max())
        width, middle = high - low, 0.5 * (low + high)
        if width > gripper.open - 0.006:
            return None
        rooms = (
            options.finger_rooms_m if hand.closing[2] == 0.0 else options.finger_rooms_m[2:]
        )  # a lower finger keeps off the table
        opening = _opening(local, near, gripper, tip, (low, high), rooms, options=options)
        if opening is not None:
            break
    else:
        return None
    quality = grasp_quality(shape, PadContents(span, tip, gripper.half_width, opening - width), hand, place, family)
    position = place + hand.closing * middle + hand.approach * (tip - gripper.tip)
    pose = np.eye(4)
    pose[:3, :3] = frame
    pose[:3, 3] = position
    outside = np.abs(local[:, 2]) <= gripper.half_width + 0.01
    first = float(local[outside, 0].min())
    retreat = float(np.clip(tip - first + 0.03, 0.07, 0.14))
    return Grasp(pose, width, opening, retreat, quality, family)


def _opening(
    local: FloatArray,
    near: FloatArray,
    gripper: GripperShape,
    tip: float,
    edges: tuple[float, float],
    rooms: tuple[float, ...],
    *,
    options: GraspSamplerOptions = GRASP_SAMPLER,
) -> float | None:
    """Return the widest opening with which fingers and palm pass; room beside the object forgives what was not seen."""
    width, middle = edges[1] - edges[0], 0.5 * (edges[0] + edges[1])
    for room in rooms:
        opening = min(gripper.open - 0.002, width + room)
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
    """Return how far beyond `place` the finger tips go along the approach, or None if they cannot."""
    wanted = (
        options.over_rim_m
        if family == "rim"
        else max(
            0.022, min(_widest_depth(local, gripper, options=options) + options.past_widest_m, options.past_middle_m)
        )
    )
    in_palm = (np.abs(local[:, 2]) <= gripper.body[1]) & (np.abs(local[:, 1]) <= gripper.body[0])
    if family == "across" and shape.rim is not None and in_palm.any():
        wanted = 0.03
    if in_palm.any():
        wanted = min(wanted, float(local[in_palm, 0].min()) + (gripper.tip - gripper.palm) - 0.008)
    # how far the lower corner of a pad is under its middle
    corner, down = gripper.half_width * abs(float(hand.lateral[2])), -float(hand.approach[2])
    lowest = (
        place[2] - shape.bottom - corner - options.half_open_m * abs(float(hand.closing[2])) - options.tip_clearance_m
    )
    wanted = min(wanted, lowest / down)
    if family == "rim" and shape.rim is not None:
        wanted = min(wanted, (shape.rim.z - shape.rim.floor_z - corner - 0.003) / down)
        return wanted if wanted > options.least_depth_m else None
    # a pad is 5 cm wide: when it comes in obliquely its lower half still holds what lies below the middle of its tip
    least = -min(0.25 * shape.height, 0.6 * gripper.half_width * float(np.cos(hand.pitch)) + 0.003)
    return wanted if wanted >= least else None


def _widest_depth(local: FloatArray, gripper: GripperShape, *, options: GraspSamplerOptions = GRASP_SAMPLER) -> float:
    """Return how far along the approach pads would have to go to hold points (N, 3) where they are widest."""
    contents = local[(np.abs(local[:, 2]) <= gripper.half_width) & (local[:, 0] <= options.past_middle_m)]
    if not len(contents):
        return 0.0
    contents = contents[np.argsort(contents[:, 0])]
    widths = np.maximum.accumulate(contents[:, 1]) - np.minimum.accumulate(contents[:, 1])
    return float(contents[int(np.searchsorted(widths, options.widest_share * widths[-1])), 0])


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
    """Tell whether open fingers or palm, coming in along the approach, meet the object itself or a neighbour."""
    for points, slack in ((local, 0.0), (near, options.side_clearance_m)):
        if not len(points):
            continue
        ahead = points[:, 0] < tip + slack
        beside = np.abs(points[:, 2]) < gripper.half_width + slack
        offset = np.abs(points[:, 1] - middle)
        own = 0.002 if slack == 0.0 else -slack
        fingers = (offset > opening / 2.0 + own) & (offset < opening / 2.0 + gripper.thickness + max(slack, 0.0))
        if (ahead & beside & fingers).any():
            return True
        palm_front = tip - (gripper.tip - gripper.palm) + 0.004 + slack
        palm = (points[:, 0] < palm_front) & (np.abs(points[:, 2]) < gripper.body[1] + slack)
        if (palm & (offset < gripper.body[0] + slack)).any():
            return True
    return False
