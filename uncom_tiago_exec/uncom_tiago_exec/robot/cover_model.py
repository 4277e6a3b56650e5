# SPDX-License-Identifier: Apache-2.0
"""Convex covers of a group's collision shapes, posed for a configuration."""

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

_HAND = re.compile(r"arm_(left|right)_tool|wrist_(left|right)|gripper_(left|right)_link")
Pairs = Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class CoverBody:
    """A solid of the quick model, the shapes it stands for, and how far what it stands for reaches beyond it [m].

    far: of its farthest point from the origin of its joint, and from the axis [m]; joint: on which it is.
    """

    solid: Any  # a pinocchio GeometryObject
    members: tuple[int, ...]
    radius: float
    far: tuple[float, float]
    joint: int


class BodyPairMargins:
    """What pairs of shapes ask of pairs of bodies.

    pairs: of bodies; outer (P, 2): of each, whether both rise with the torso, and the joint of the one farther out;
    places, shapes, radii (K,): pair of bodies, pair of shapes that asks, and what is added to its margin [m].
    """

    def __init__(
        self, pairs: Pairs, margins: FloatArray, of_shape: Sequence[Sequence[int]], bodies: Sequence[CoverBody],
        first_shapes: int, first_bodies: int,*, options: ConvexCoverOptions = CONVEX_COVERS
    ) -> None:  # fmt: skip
        """Count pairs of shapes and pairs of bodies from the given numbers on."""
        self._options = options
        place: dict[tuple[int, int], int] = {}
        found: list[tuple[int, int, float]] = []
        for k, (i, j) in enumerate(pairs):
            if margins[k] < 0.0:
                continue
            for a in of_shape[i]:
                for b in of_shape[j]:
                    key = (a, b) if a < b else (b, a)
                    at = place.setdefault(key, len(place))
                    found.append(
                        (
                            first_bodies + at,
                            first_shapes + k,
                            bodies[a].radius + bodies[b].radius + self._options.slack_m,
                        )
                    )
        columns = np.array(found).reshape(-1, 3)
        self.pairs = list(place)
        self.places, self.shapes = columns[:, 0].astype(np.intp), columns[:, 1].astype(np.intp)
        self.radii = columns[:, 2]
        joints = [(bodies[a].joint, bodies[b].joint) for a, b in self.pairs]
        # what rises with the torso comes no nearer to its like when the torso rises
        self.outer = np.array([(int(min(pair) > 0), max(pair)) for pair in joints], dtype=np.intp).reshape(-1, 2)


@dataclass(frozen=True, slots=True)
class SharedPairs:
    """What all quick checkers of a group begin with."""

    geometry: Any
    demands: BodyPairMargins
    reach: FloatArray


class CoverModel:
    """Covers of all shapes of one group, and how far they move when its joints do."""

    def __init__(
        self, model: Any, geometry: Any, links: Sequence[str], *, options: ConvexCoverOptions = CONVEX_COVERS
    ) -> None:
        """Place the covers where the shapes are; shapes that are no mesh, box or cylinder stay as they are."""
        self._options = options
        self.model = model
        self.bodies: list[CoverBody] = []
        objects = list(geometry.geometryObjects)
        hands: dict[tuple[int, str], list[int]] = {}
        for i, solid in enumerate(objects):
            found = _HAND.match(links[i])
            corners = shape_corners(solid.geometry)
            if found and corners is not None and not links[i].endswith("finger_link"):
                hands.setdefault((solid.parentJoint, next(filter(None, found.groups()))), []).append(i)
            elif corners is not None and isinstance(solid.geometry, coal.BVHModelBase):
                fine = solid.parentJoint != 1 or links[i].startswith("torso")
                self._add_covers(solid, (i,), corners, fine=fine)
            else:
                self.bodies.append(body_of_shape(solid, i))
        for members in hands.values():
            first = objects[members[0]]
            points = [
                _placed_corners(first.placement.inverse() * objects[i].placement, objects[i].geometry) for i in members
            ]
            self._add_covers(first, tuple(members), np.vstack(points), fine=False)
        self.of_shape: list[list[int]] = [[] for _ in objects]
        for k, body in enumerate(self.bodies):
            for i in body.members:
                self.of_shape[i].append(k)

        self.far = [(0.0, 0.0)] * (model.nq + 1)
        for body in self.bodies:
            before = self.far[body.joint]
            self.far[body.joint] = (max(before[0], body.far[0]), max(before[1], body.far[1]))
        self._bases: dict[Any, SharedPairs] = {}

    def base(self, pairs: tuple[tuple[int, int], ...], margins: FloatArray) -> SharedPairs:
        """Return what checkers for these pairs of the body begin with; negative margins leave pairs out."""
        key = pairs, (margins < 0.0).tobytes()
        if key not in self._bases:
            geometry = pin.GeometryModel()
            for body in self.bodies:
                geometry.addGeometryObject(body.solid)
            demands = BodyPairMargins(pairs, margins, self.of_shape, self.bodies, 0, 0)
            for a, b in demands.pairs:
                geometry.addCollisionPair(pin.CollisionPair(a, b))
            self._bases[key] = SharedPairs(
                geometry, demands, joint_travel(self.model, self.far, (), options=self._options)
            )
        return self._bases[key]

    def _add_covers(self, solid: Any, members: tuple[int, ...], corners: FloatArray, *, fine: bool) -> None:
        for n, cover in enumerate(convex_covers(corners, fine=fine)):
            body = pin.GeometryObject(
                f"{solid.name}:{n}", solid.parentJoint, solid.parentFrame, solid.placement, cover.body
            )
            # the hash of a hand's corners forgives what placements are rounded by
            radius = cover.radius + (2.0 * self._options.slack_m if len(members) > 1 else 0.0)
            self.bodies.append(
                CoverBody(
                    body, members, radius, _farthest_points(solid.placement, cover.corners, radius), solid.parentJoint
                )
            )


def body_of_shape(solid: Any, index: int) -> CoverBody:
    """Return the body that is a shape itself."""
    corners = shape_corners(solid.geometry) if solid.parentJoint > 0 else np.zeros((1, 3))
    if corners is None:
        shape = solid.geometry
        shape.computeLocalAABB()
        low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return CoverBody(solid, (index,), 0.0, _farthest_points(solid.placement, corners, 0.0), solid.parentJoint)


def _farthest_points(placement: Any, corners: FloatArray, radius: float) -> tuple[float, float]:
    at = corners @ placement.rotation.T + placement.translation
    squares = at * at
    beside = squares[:, 0] + squares[:, 1]
    return float(np.sqrt((beside + squares[:, 2]).max())) + radius, float(np.sqrt(beside.max())) + radius


def _placed_corners(placement: Any, shape: Any) -> FloatArray:
    corners = shape_corners(shape)
    if corners is None:
        raise TypeError(type(shape).__name__)
    return np.asarray(corners @ placement.rotation.T + placement.translation)


def joint_travel(
    model: Any,
    far: Sequence[tuple[float, float]],
    held: Sequence[CoverBody],
    *,
    options: ConvexCoverOptions = CONVEX_COVERS,
) -> FloatArray:
    """Return (8, 9) how far solids on joint k (column) move at most when joint j + 1 (row) does [m/rad, or m/m]."""
    count = model.nq
    reach = np.zeros((count, count + 1))
    offsets = [np.array(model.jointPlacements[j].translation) for j in range(1, count + 1)]
    beside = [float(np.hypot(offset[0], offset[1])) for offset in offsets]
    apart = [float(np.linalg.norm(offset)) for offset in offsets]
    turns = [str(model.joints[j].shortname()).startswith("JointModelR") for j in range(1, count + 1)]
    for k in range(1, count + 1):
        ends = [far[k], *(body.far for body in held if body.joint == k)]
        ball, round_axis = max(end[0] for end in ends), max(end[1] for end in ends)
        for j in range(k - 1, -1, -1):
            reach[j, k] = (round_axis if turns[j] else 1.0) + options.slack_m
            round_axis = beside[j] + ball
            ball += apart[j]
    return reach
