# SPDX-License-Identifier: Apache-2.0
"""A first look at a configuration with convex covers of the robot's shapes in place of its meshes.

What it calls free is free, and with room to spare if demands for; what it does not call free has to be looked at with
the meshes themselves. It is several times as fast: bodies are fewer, and a pair of them costs a microsecond where two
meshes that are nearly in contact cost a hundred.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from uncom_tiago_exec.collision.options import CONVEX_CHECKER, ConvexCheckerOptions
from uncom_tiago_exec.robot.cover_model import BodyPairMargins, CoverModel, Pairs, body_of_shape, joint_travel
from uncom_tiago_exec.types import FloatArray


class ConvexChecker:
    """Looks at configurations of one group in one scene; made for the pairs and margins of a checker."""

    def __init__(
        self,
        covers: CoverModel,
        others: Sequence[Any],
        pairs: Pairs,
        margins: FloatArray,
        of_body: int,
        *,
        options: ConvexCheckerOptions = CONVEX_CHECKER,
    ) -> None:
        """Build the model of covers and of `others` (what a checker has added); pairs and margins are the checker's.

        The first `of_body` pairs are the same for all checkers of a group, but for their margins. Pairs that are
        always kept may be left out by a negative margin.
        """
        self._options = options
        self.model = covers.model
        base = covers.base(tuple(pairs[:of_body]), margins[:of_body])
        bodies, of_shape = list(covers.bodies), list(covers.of_shape)
        wanted = {i for pair in pairs[of_body:] for i in pair}
        self._geometry = base.geometry.copy()
        for k, solid in enumerate(others, len(of_shape)):
            of_shape.append([len(bodies)] if k in wanted else [])
            if k in wanted:
                bodies.append(body_of_shape(solid, k))
                self._geometry.addGeometryObject(solid)
        rest = BodyPairMargins(pairs[of_body:], margins[of_body:], of_shape, bodies, of_body, len(base.demands.pairs))
        for a, b in rest.pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(a, b))
        self._demands = (base.demands, rest)
        held = [body for body in bodies[len(covers.bodies) :] if body.joint > 0]
        reach = joint_travel(self.model, covers.far, held) if held else base.reach
        reaches = np.stack([reach, reach * (np.arange(len(reach)) > 0)[:, None]])
        pace = np.array(self.model.velocityLimit) @ reaches[1]
        # near the shoulder little moves and little room is left; far from it, and from the scene, there is more
        self._share_by_joint = np.stack([np.maximum(pace / pace.max(), least) for least in self._options.least_shares])
        self._shares = np.concatenate([self._share_by_joint[tuple(demands.outer.T)] for demands in self._demands])
        self._travel_per_joint = np.hstack(reaches[:, :, 1:] / self._share_by_joint[:, None, 1:])
        self._data = self.model.createData()
        self._margins = self._margins_from(margins)
        self._managers: dict[float, tuple[Any, Any]] = {}
        self._without_clearance = self._manager(0.0)[1]

    def _margins_from(self, margins: FloatArray) -> FloatArray:
        """Return the margin of each pair of bodies: the greatest that its shapes ask for."""
        least = np.zeros(len(self._shares))
        for demands in self._demands:
            np.maximum.at(least, demands.places, margins[demands.shapes] + demands.radii)
        return least

    def _manager(self, room: float) -> tuple[Any, Any]:
        """Return data and manager that look for a room beside the margins [m], made when they are first needed."""
        if room not in self._managers:
            gdata = self._geometry.createData()
            self._set_margins(gdata, room)
            made = pin.BroadPhaseManager_NaiveCollisionManager(self.model, self._geometry, gdata)
            self._managers[room] = gdata, made
        return self._managers[room]

    def _set_margins(self, gdata: Any, room: float) -> None:
        for request, margin in zip(
            gdata.collisionRequests, (self._margins + room * self._shares).tolist(), strict=True
        ):
            request.security_margin = margin

    def lower(self, margins: FloatArray) -> None:
        """Set the margins of the checker's pairs anew; none may be greater than before."""
        self._margins = np.minimum(self._margins, self._margins_from(margins))
        for room, (gdata, _) in self._managers.items():
            self._set_margins(gdata, room)

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) surely keeps every margin."""
        return not pin.computeCollisions(self.model, self._data, self._without_clearance, q, True)

    def has_clearance(self, q: FloatArray, room: float) -> bool:
        """Tell whether a configuration (8,) surely keeps every margin while `moves` grows or shrinks by a room [m]."""
        return not pin.computeCollisions(self.model, self._data, self._manager(room)[1], q, True)

    def clearance_shares(self, joint: int) -> tuple[float, float]:
        """Return which shares of a room solids on a joint have: against what stands still, and what rises with them."""
        return float(self._share_by_joint[0, joint]), float(self._share_by_joint[1, joint])

    def travel_between(self, difference: FloatArray) -> float:
        """Return how far solids move at most when the joints go by (8,) [m], each by its share of the room."""
        return float((np.abs(difference) @ self._travel_per_joint).max())

    def travel_along(self, points: FloatArray) -> FloatArray:
        """Return (N,) how far along a path (N, 8) solids have moved at most [m], each by its share of the room."""
        steps = (np.abs(np.diff(points, axis=0)) @ self._travel_per_joint).max(axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])
