# SPDX-License-Identifier: Apache-2.0
"""Convex covers of all collision shapes of a planning group, the margins they need, and how far joints move them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from uncom_tiago_exec.robot.convex_covers import convex_covers, shape_corners
from uncom_tiago_exec.robot.options import CONVEX_COVERS, ConvexCoverOptions
from uncom_tiago_exec.types import FloatArray

_HAND_LINKS = re.compile(r"arm_(left|right)_tool|wrist_(left|right)|gripper_(left|right)_link")
Pairs = Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class CoverBody:
    """A body of the cover model.

    Attributes:
        solid: the body as a pinocchio GeometryObject.
        shapes: indices of the collision shapes that it covers.
        radius: greatest distance of a covered point from the body [m].
        extents: greatest distances of a covered point from the origin and from the z axis of its joint [m].
        joint: index of the joint in the model that moves it; 0 if none does.
    """

    solid: Any
    shapes: tuple[int, ...]
    radius: float
    extents: tuple[float, float]
    joint: int


class BodyPairMargins:
    """The pairs of bodies that stand for pairs of collision shapes, and what the margins of the bodies follow from.

    Several pairs of shapes may need the same pair of bodies; K counts the combinations of the two.

    Attributes:
        pairs: of bodies (P).
        body_pairs (K,): number of the pair of bodies.
        shape_pairs (K,): number of the pair of shapes.
        radii (K,): distance that is added to the margin of the shapes to get that of the bodies [m].
        share_indices (P, 2): whether the torso lifts both bodies (1) or not (0), and the joint of the outer one.
    """

    def __init__(
        self,
        pairs: Pairs,
        margins: FloatArray,
        bodies_of_shape: Sequence[Sequence[int]],
        bodies: Sequence[CoverBody],
        first_shape_pair: int,
        first_body_pair: int,
        *,
        options: ConvexCoverOptions = CONVEX_COVERS,
    ) -> None:
        """Find the pairs of bodies for pairs of shapes.

        Args:
            pairs: of shapes.
            margins: of those pairs [m]; a negative one leaves the pair out.
            bodies_of_shape: indices of the bodies that cover each shape.
            bodies: all bodies.
            first_shape_pair: number of the first of the pairs of shapes.
            first_body_pair: number of the first pair of bodies.
            options: numbers that tune it.
        """
        numbers: dict[tuple[int, int], int] = {}
        found: list[tuple[int, int, float]] = []
        for k, (i, j) in enumerate(pairs):
            if margins[k] < 0.0:
                continue
            for a in bodies_of_shape[i]:
                for b in bodies_of_shape[j]:
                    key = (a, b) if a < b else (b, a)
                    number = first_body_pair + numbers.setdefault(key, len(numbers))
                    found.append((number, first_shape_pair + k, bodies[a].radius + bodies[b].radius + options.slack_m))
        columns = np.array(found).reshape(-1, 3)
        self.pairs = list(numbers)
        self.body_pairs, self.shape_pairs = columns[:, 0].astype(np.intp), columns[:, 1].astype(np.intp)
        self.radii = columns[:, 2]
        joints = [(bodies[a].joint, bodies[b].joint) for a, b in self.pairs]
        # the torso does not change the distance of two bodies that it lifts both
        self.share_indices = np.array([(int(min(pair) > 0), max(pair)) for pair in joints], dtype=np.intp).reshape(
            -1, 2
        )


@dataclass(frozen=True, slots=True)
class SelfCollisionPairs:
    """What every cover checker of a group begins with: the bodies of the robot itself.

    Attributes:
        geometry: pinocchio geometry model with all bodies and their pairs.
        margins: how the margins of the pairs follow from those of the shapes.
        travel: of the bodies with the joints (8, 9), see joint_travel.
    """

    geometry: Any
    margins: BodyPairMargins
    travel: FloatArray


class CoverModel:
    """Covers of all collision shapes of one group, and how far they move with its joints.

    Attributes:
        model: pinocchio model of the group.
        bodies: all bodies.
        bodies_of_shape: indices of the bodies that cover each collision shape.
        extents: for each joint of the model, greatest extents of the bodies that it carries [m], see CoverBody.
    """

    def __init__(
        self, model: Any, geometry: Any, links: Sequence[str], *, options: ConvexCoverOptions = CONVEX_COVERS
    ) -> None:
        """Cover all shapes of a pinocchio geometry model; those that are no mesh, box or cylinder stay as they are.

        Args:
            model: pinocchio model of the group.
            geometry: its collision shapes.
            links: name of the link of each shape.
            options: numbers that tune it.
        """
        self._options = options
        self.model = model
        self.bodies: list[CoverBody] = []
        objects = list(geometry.geometryObjects)
        hands: dict[tuple[int, str], list[int]] = {}  # the shapes of a hand do not move in it: one body for all
        for i, solid in enumerate(objects):
            found = _HAND_LINKS.match(links[i])
            corners = shape_corners(solid.geometry, options=options)
            if found and corners is not None and not links[i].endswith("finger_link"):
                hands.setdefault((solid.parentJoint, next(filter(None, found.groups()))), []).append(i)
            elif corners is not None and isinstance(solid.geometry, coal.BVHModelBase):
                detailed = solid.parentJoint != 1 or links[i].startswith("torso")
                self._add_covers(solid, (i,), corners, detailed=detailed)
            else:
                self.bodies.append(exact_body(solid, i, options=options))
        for shapes in hands.values():
            first = objects[shapes[0]]
            points = [
                _placed_corners(first.placement.inverse() * objects[i].placement, objects[i].geometry, options=options)
                for i in shapes
            ]
            self._add_covers(first, tuple(shapes), np.vstack(points), detailed=False)
        self.bodies_of_shape: list[list[int]] = [[] for _ in objects]
        for k, body in enumerate(self.bodies):
            for i in body.shapes:
                self.bodies_of_shape[i].append(k)

        self.extents = [(0.0, 0.0)] * (model.nq + 1)
        for body in self.bodies:
            before = self.extents[body.joint]
            self.extents[body.joint] = (max(before[0], body.extents[0]), max(before[1], body.extents[1]))
        self._self_collision: dict[Any, SelfCollisionPairs] = {}

    def self_collision_pairs(self, pairs: tuple[tuple[int, int], ...], margins: FloatArray) -> SelfCollisionPairs:
        """Return the bodies for pairs (P) of the robot's own shapes; negative margins (P,) leave pairs out."""
        key = pairs, (margins < 0.0).tobytes()
        if key not in self._self_collision:
            geometry = pin.GeometryModel()
            for body in self.bodies:
                geometry.addGeometryObject(body.solid)
            body_margins = BodyPairMargins(
                pairs, margins, self.bodies_of_shape, self.bodies, 0, 0, options=self._options
            )
            for a, b in body_margins.pairs:
                geometry.addCollisionPair(pin.CollisionPair(a, b))
            travel = joint_travel(self.model, self.extents, (), options=self._options)
            self._self_collision[key] = SelfCollisionPairs(geometry, body_margins, travel)
        return self._self_collision[key]

    def _add_covers(self, solid: Any, shapes: tuple[int, ...], corners: FloatArray, *, detailed: bool) -> None:
        """Add bodies that cover corners (N, 3), given in the frame of a geometry object, for some shapes."""
        for n, cover in enumerate(convex_covers(corners, detailed=detailed, options=self._options)):
            body = pin.GeometryObject(
                f"{solid.name}:{n}", solid.parentJoint, solid.parentFrame, solid.placement, cover.body
            )
            # covers are found by a hash of rounded corners: for merged shapes their placements were rounded, too
            radius = cover.radius + (2.0 * self._options.slack_m if len(shapes) > 1 else 0.0)
            extents = _measure_extents(solid.placement, cover.corners, radius)
            self.bodies.append(CoverBody(body, shapes, radius, extents, solid.parentJoint))


def exact_body(solid: Any, index: int, *, options: ConvexCoverOptions = CONVEX_COVERS) -> CoverBody:
    """Return the body that is a collision shape itself: a pinocchio geometry object, and its index among the shapes."""
    corners = shape_corners(solid.geometry, options=options) if solid.parentJoint > 0 else np.zeros((1, 3))
    if corners is None:
        shape = solid.geometry
        shape.computeLocalAABB()
        low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return CoverBody(solid, (index,), 0.0, _measure_extents(solid.placement, corners, 0.0), solid.parentJoint)


def _measure_extents(placement: Any, corners: FloatArray, radius: float) -> tuple[float, float]:
    """Return the greatest distances from origin and z axis of a joint [m] of points within `radius` of corners."""
    points = corners @ placement.rotation.T + placement.translation
    squares = points * points
    from_axis = squares[:, 0] + squares[:, 1]
    return float(np.sqrt((from_axis + squares[:, 2]).max())) + radius, float(np.sqrt(from_axis.max())) + radius


def _placed_corners(placement: Any, shape: Any, *, options: ConvexCoverOptions = CONVEX_COVERS) -> FloatArray:
    """Return the corners (N, 3) of a shape in the frame that its placement is given in [m].

    Raises:
        TypeError: it is no box, cylinder or mesh.
    """
    corners = shape_corners(shape, options=options)
    if corners is None:
        raise TypeError(type(shape).__name__)
    return np.asarray(corners @ placement.rotation.T + placement.translation)


def joint_travel(
    model: Any,
    extents: Sequence[tuple[float, float]],
    held: Sequence[CoverBody],
    *,
    options: ConvexCoverOptions = CONVEX_COVERS,
) -> FloatArray:
    """Return bounds (8, 9) on how far bodies on joint k (column) move when joint j + 1 (row) does [m/rad, or m/m].

    A point moves by at most its distance from the axis of a revolute joint for each radian. For the joint that carries
    the body that distance is the second of the extents. For a joint farther up the chain it is bounded, in any
    posture, by the distance of the next joint's origin from the axis plus the lengths of the links after it plus the
    first of the extents. For the torso's prismatic joint it is 1.

    Args:
        model: pinocchio model of the group, one chain of joints.
        extents: for each joint (9), of the robot's own bodies on it [m], see CoverBody.
        held: further bodies, held in the hand.
        options: numbers that tune it.
    """
    count = model.nq
    travel = np.zeros((count, count + 1))
    offsets = [np.array(model.jointPlacements[j].translation) for j in range(1, count + 1)]
    from_axis = [float(np.hypot(offset[0], offset[1])) for offset in offsets]
    lengths = [float(np.linalg.norm(offset)) for offset in offsets]
    revolute = [str(model.joints[j].shortname()).startswith("JointModelR") for j in range(1, count + 1)]
    for k in range(1, count + 1):
        carried = [extents[k], *(body.extents for body in held if body.joint == k)]
        origin_bound, axis_bound = max(e[0] for e in carried), max(e[1] for e in carried)
        for j in range(k - 1, -1, -1):
            travel[j, k] = (axis_bound if revolute[j] else 1.0) + options.slack_m
            axis_bound = from_axis[j] + origin_bound
            origin_bound += lengths[j]
    return travel
