# SPDX-License-Identifier: Apache-2.0
"""A first look at a configuration with convex covers of the robot's shapes in place of its meshes.

What it calls free is free, and with room to spare if asked for; what it does not call free has to be looked at with
the meshes themselves. It is several times as fast: bodies are fewer, and a pair of them costs a microsecond where two
meshes that are nearly in contact cost a hundred.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from uncom_tiago_exec.covers import SLACK, corners_of, covers_of
from uncom_tiago_exec.types import FloatArray

_HAND = re.compile(r"arm_(left|right)_tool|wrist_(left|right)|gripper_(left|right)_link")
ROOMS = (0.06, 0.02, 0.008)  # [m] that the farthest moving solid is asked to have beside its margins, most first
# shares of that room that all solids have: against what stands still, and against what rises with the torso
_LEAST_SHARES = (0.3, 0.02)

Pairs = Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class _Body:
    """A solid of the quick model, the shapes it stands for, and how far what it stands for reaches beyond it [m].

    far: of its farthest point from the origin of its joint, and from the axis [m].
    """

    thing: Any  # a pinocchio GeometryObject
    members: tuple[int, ...]
    radius: float
    far: tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Contributions:
    """Which pair of shapes asks for how much between which pair of bodies: places of both, and radii [m], each (K,)."""

    bodies: npt.NDArray[np.intp]
    shapes: npt.NDArray[np.intp]
    radii: FloatArray

    def margins(self, margins: FloatArray) -> FloatArray:
        """Return the margin of each pair of bodies: the greatest that its shapes ask for."""
        least = np.zeros(int(self.bodies.max(initial=-1)) + 1)
        np.maximum.at(least, self.bodies, margins[self.shapes] + self.radii)
        return least


class CoverModel:
    """Covers of all shapes of one group, and how far they move when its joints do."""

    def __init__(self, model: Any, geometry: Any, links: Sequence[str]) -> None:
        """Place the covers where the shapes are; shapes that are no mesh, box or cylinder stay as they are."""
        self.model = model
        self.bodies: list[_Body] = []
        objects = list(geometry.geometryObjects)
        hands: dict[tuple[int, str], list[int]] = {}
        for i, thing in enumerate(objects):
            found = _HAND.match(links[i])
            corners = corners_of(thing.geometry)
            if found and corners is not None and not links[i].endswith("finger_link"):
                hands.setdefault((thing.parentJoint, next(filter(None, found.groups()))), []).append(i)
            elif corners is not None and isinstance(thing.geometry, coal.BVHModelBase):
                fine = thing.parentJoint != 1 or links[i].startswith("torso")
                self._add_covers(thing, (i,), corners, fine=fine)
            else:
                self.bodies.append(as_it_is(thing, i))
        for members in hands.values():
            first = objects[members[0]]
            points = [_placed(first.placement.inverse() * objects[i].placement, objects[i].geometry) for i in members]
            self._add_covers(first, tuple(members), np.vstack(points), fine=False)
        self.of_shape: list[list[int]] = [[] for _ in objects]
        for k, body in enumerate(self.bodies):
            for i in body.members:
                self.of_shape[i].append(k)

    def _add_covers(self, thing: Any, members: tuple[int, ...], corners: FloatArray, *, fine: bool) -> None:
        for n, cover in enumerate(covers_of(corners, fine=fine)):
            body = pin.GeometryObject(
                f"{thing.name}:{n}", thing.parentJoint, thing.parentFrame, thing.placement, cover.body
            )
            # the hash of a hand's corners forgives what placements are rounded by
            radius = cover.radius + (2.0 * SLACK if len(members) > 1 else 0.0)
            self.bodies.append(_Body(body, members, radius, _far(thing.placement, cover.corners, radius)))


def as_it_is(thing: Any, index: int) -> _Body:
    """Return the body that is a shape itself."""
    corners = corners_of(thing.geometry) if thing.parentJoint > 0 else np.zeros((1, 3))
    if corners is None:
        shape = thing.geometry
        shape.computeLocalAABB()
        low, high = np.array(shape.aabb_local.min_), np.array(shape.aabb_local.max_)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return _Body(thing, (index,), 0.0, _far(thing.placement, corners, 0.0))


def _far(placement: Any, corners: FloatArray, radius: float) -> tuple[float, float]:
    at = corners @ placement.rotation.T + placement.translation
    squares = at * at
    beside = squares[:, 0] + squares[:, 1]
    return float(np.sqrt((beside + squares[:, 2]).max())) + radius, float(np.sqrt(beside.max())) + radius


def _placed(placement: Any, shape: Any) -> FloatArray:
    corners = corners_of(shape)
    if corners is None:
        raise TypeError(type(shape).__name__)
    return np.asarray(corners @ placement.rotation.T + placement.translation)


class QuickChecker:
    """Looks at configurations of one group in one scene; made for the pairs and margins of a checker."""

    def __init__(self, covers: CoverModel, others: Sequence[Any], pairs: Pairs, margins: FloatArray) -> None:
        """Build the model of covers and of `others` (what a checker has added); pairs and margins are the checker's.

        Pairs that can never touch may be left out by a negative margin.
        """
        self.model = covers.model
        bodies, of_shape = list(covers.bodies), list(covers.of_shape)
        wanted = {i for pair, margin in zip(pairs, margins, strict=True) if margin >= 0.0 for i in pair}
        for k, thing in enumerate(others, len(of_shape)):
            of_shape.append([len(bodies)] if k in wanted else [])
            if k in wanted:
                bodies.append(as_it_is(thing, k))
        self._geometry = pin.GeometryModel()
        for body in bodies:
            self._geometry.addGeometryObject(body.thing)
        self._asked, looked_at = _contributions(pairs, margins, of_shape, bodies)
        for a, b in looked_at:
            self._geometry.addCollisionPair(pin.CollisionPair(a, b))
        joints = [body.thing.parentJoint for body in bodies]
        # what rises with the torso comes no nearer to its like when the torso rises
        outer = [(int(min(joints[a], joints[b]) > 0), max(joints[a], joints[b])) for a, b in looked_at]
        reach = _farthest(self.model, bodies)
        reaches = np.stack([reach, reach * (np.arange(len(reach)) > 0)[:, None]])
        pace = np.array(self.model.velocityLimit) @ reaches[1]
        # near the shoulder little moves and little room is left; far from it, and from the scene, there is more
        shares = np.stack([np.maximum(pace / pace.max(), least_share) for least_share in _LEAST_SHARES])
        self._share_of_joint = shares
        self._shares = shares[tuple(np.array(outer).T)] if outer else np.zeros(0)
        self._per_room = np.hstack(reaches[:, :, 1:] / shares[:, None, 1:])
        self._data = self.model.createData()
        self._margins = self._asked.margins(margins)
        self._managers: dict[float, tuple[Any, Any]] = {}
        self._plain = self._manager(0.0)[1]

    def _manager(self, room: float) -> tuple[Any, Any]:
        """Return data and manager that look for a room beside the margins [m], made when they are first needed."""
        if room not in self._managers:
            gdata = self._geometry.createData()
            self._set(gdata, room)
            made = pin.BroadPhaseManager_NaiveCollisionManager(self.model, self._geometry, gdata)
            self._managers[room] = gdata, made
        return self._managers[room]

    def _set(self, gdata: Any, room: float) -> None:
        for request, margin in zip(
            gdata.collisionRequests, (self._margins + room * self._shares).tolist(), strict=True
        ):
            request.security_margin = margin

    def lower(self, margins: FloatArray) -> None:
        """Set the margins of the checker's pairs anew; none may be greater than before."""
        self._margins = np.minimum(self._margins, self._asked.margins(margins))
        for room, (gdata, _) in self._managers.items():
            self._set(gdata, room)

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) surely keeps every margin."""
        return not pin.computeCollisions(self.model, self._data, self._plain, q, True)

    def has_room(self, q: FloatArray, room: float) -> bool:
        """Tell whether a configuration (8,) surely keeps every margin while `moves` grows or shrinks by a room [m]."""
        return not pin.computeCollisions(self.model, self._data, self._manager(room)[1], q, True)

    def share_of(self, joint: int) -> tuple[float, float]:
        """Return which shares of a room solids on a joint have: against what stands still, and what rises with them."""
        return float(self._share_of_joint[0, joint]), float(self._share_of_joint[1, joint])

    def way(self, way: FloatArray) -> float:
        """Return how far solids move at most when the joints go by (8,) [m], each by its share of the room."""
        return float((np.abs(way) @ self._per_room).max())

    def moves(self, points: FloatArray) -> FloatArray:
        """Return (N,) how far along a path (N, 8) solids have moved at most [m], each by its share of the room."""
        steps = (np.abs(np.diff(points, axis=0)) @ self._per_room).max(axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


def _contributions(
    pairs: Pairs, margins: FloatArray, of_shape: Sequence[Sequence[int]], bodies: Sequence[_Body]
) -> tuple[_Contributions, list[tuple[int, int]]]:
    """Return what pairs of shapes ask of pairs of bodies, and those pairs of bodies."""
    place: dict[tuple[int, int], int] = {}
    found: list[tuple[int, int, float]] = []
    for k, (i, j) in enumerate(pairs):
        if margins[k] < 0.0:
            continue
        for a in of_shape[i]:
            for b in of_shape[j]:
                key = (a, b) if a < b else (b, a)
                found.append((place.setdefault(key, len(place)), k, bodies[a].radius + bodies[b].radius + SLACK))
    columns = np.array(found).reshape(-1, 3)
    return _Contributions(columns[:, 0].astype(np.intp), columns[:, 1].astype(np.intp), columns[:, 2]), list(place)


def _farthest(model: Any, bodies: Sequence[_Body]) -> FloatArray:
    """Return (8, 9) how far solids on joint k (column) move at most when joint j + 1 (row) does [m/rad, or m/m]."""
    count = model.nq
    reach = np.zeros((count, count + 1))
    for k in range(1, count + 1):
        far = [body.far for body in bodies if body.thing.parentJoint == k] or [(0.0, 0.0)]
        ball, round_axis = max(f[0] for f in far), max(f[1] for f in far)
        for j in range(k, 0, -1):
            turns = str(model.joints[j].shortname()).startswith("JointModelR")
            reach[j - 1, k] = (round_axis if turns else 1.0) + SLACK
            offset = model.jointPlacements[j].translation
            round_axis = float(np.hypot(offset[0], offset[1])) + ball
            ball += float(np.linalg.norm(offset))
    return reach
