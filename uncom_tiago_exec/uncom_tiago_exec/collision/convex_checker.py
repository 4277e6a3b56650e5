# SPDX-License-Identifier: Apache-2.0
r"""Fast, conservative collision checks with convex covers of the robot's shapes in place of its meshes.

A configuration that this checker calls free is free for the meshes too; one that it does not call free has to be
checked with the meshes themselves (mesh_checker.py). It is several times as fast: there are fewer pairs, and a pair of
covers takes a microsecond where two meshes near contact take a hundred.

It also gives what adaptive checks of whole paths need (Schwarzer, Saha and Latombe 2005). For the pair of bodies p,
with margin m_p and distance d_p(q), and a change of the joints from q to q', let D_p(q, q') bound the displacement of
its outer body relative to the inner one. Then

$$d_p(q') \ge d_p(q) - D_p(q, q').$$

With a fixed share s_p of each pair, a configuration has the clearance c if d_p(q) > m_p + c s_p for all pairs
(`has_clearance`), and the travel from q to q' is t = max_p D_p(q, q') / s_p (`travel_between`). If t <= c, every pair
keeps its margin at q'. The shares are larger for bodies that move more, so that one number c fits both the upper arm,
which moves little and is always close to the torso, and the hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from uncom_tiago_exec.collision.options import CONVEX_CHECKER, ConvexCheckerOptions
from uncom_tiago_exec.robot.cover_model import BodyPairMargins, CoverModel, Pairs, exact_body, joint_travel
from uncom_tiago_exec.types import FloatArray


class ConvexChecker:
    """Checks configurations of one group in one scene, for the pairs and margins of a CollisionChecker."""

    def __init__(
        self,
        covers: CoverModel,
        added: Sequence[Any],
        pairs: Pairs,
        margins: FloatArray,
        self_collision_pairs: int,
        *,
        options: ConvexCheckerOptions = CONVEX_CHECKER,
    ) -> None:
        """Build the collision model.

        Args:
            covers: of the shapes of the group.
            added: obstacles and held solids as pinocchio geometry objects; their indices follow those of the group.
            pairs: of shapes to check (P), those of the robot with itself first.
            margins: of those pairs (P,) [m]; a negative one leaves out a pair that always keeps its margin.
            self_collision_pairs: number of pairs of the robot with itself; they are the same for all checkers of a
                group but for their margins.
            options: numbers that tune it.
        """
        self._options = options
        self.model = covers.model
        first = self_collision_pairs
        robot = covers.self_collision_pairs(tuple(pairs[:first]), margins[:first])
        bodies, bodies_of_shape = list(covers.bodies), list(covers.bodies_of_shape)
        used = {i for pair in pairs[first:] for i in pair}
        self._geometry = robot.geometry.copy()
        for k, solid in enumerate(added, len(bodies_of_shape)):
            bodies_of_shape.append([len(bodies)] if k in used else [])
            if k in used:
                bodies.append(exact_body(solid, k))
                self._geometry.addGeometryObject(solid)
        scene = BodyPairMargins(
            pairs[first:], margins[first:], bodies_of_shape, bodies, first, len(robot.margins.pairs)
        )
        for a, b in scene.pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(a, b))
        self._pair_margins = (robot.margins, scene)
        held = [body for body in bodies[len(covers.bodies) :] if body.joint > 0]
        travel = joint_travel(self.model, covers.extents, held) if held else robot.travel
        self._set_shares(travel)
        self._data = self.model.createData()
        self._margins = self._body_margins(margins)
        self._managers: dict[float, tuple[Any, Any]] = {}
        self._without_clearance = self._manager(0.0)[1]

    def _set_shares(self, travel: FloatArray) -> None:
        """Set the shares of a clearance from the travel of bodies with the joints (8, 9), see joint_travel."""
        # with respect to what stands still, and to what the torso lifts as well: the torso's row is zero
        travels = np.stack([travel, travel * (np.arange(len(travel)) > 0)[:, None]])
        top_speeds = np.array(self.model.velocityLimit) @ travels[1]
        self._share_by_joint = np.stack(
            [np.maximum(top_speeds / top_speeds.max(), least) for least in self._options.least_shares]
        )
        self._shares = np.concatenate([self._share_by_joint[tuple(m.share_indices.T)] for m in self._pair_margins])
        self._travel_per_joint = np.hstack(travels[:, :, 1:] / self._share_by_joint[:, None, 1:])

    def _body_margins(self, margins: FloatArray) -> FloatArray:
        """Return the margin of each pair of bodies [m]: the greatest that one of the pairs of shapes needs."""
        greatest = np.zeros(len(self._shares))
        for pair_margins in self._pair_margins:
            np.maximum.at(greatest, pair_margins.body_pairs, margins[pair_margins.shape_pairs] + pair_margins.radii)
        return greatest

    def _manager(self, clearance: float) -> tuple[Any, Any]:
        """Return geometry data and broad phase for the margins plus a clearance [m], made when first needed."""
        if clearance not in self._managers:
            gdata = self._geometry.createData()
            self._set_margins(gdata, clearance)
            manager = pin.BroadPhaseManager_NaiveCollisionManager(self.model, self._geometry, gdata)
            self._managers[clearance] = gdata, manager
        return self._managers[clearance]

    def _set_margins(self, gdata: Any, clearance: float) -> None:
        """Set the margins of all pairs in geometry data, plus their shares of a clearance [m]."""
        for request, margin in zip(
            gdata.collisionRequests, (self._margins + clearance * self._shares).tolist(), strict=True
        ):
            request.security_margin = margin

    def lower_margins(self, margins: FloatArray) -> None:
        """Set new margins (P,) of the pairs of shapes [m]; none may be greater than before."""
        self._margins = np.minimum(self._margins, self._body_margins(margins))
        for clearance, (gdata, _) in self._managers.items():
            self._set_margins(gdata, clearance)

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) certainly keeps every margin."""
        return not pin.computeCollisions(self.model, self._data, self._without_clearance, q, True)

    def has_clearance(self, q: FloatArray, clearance: float) -> bool:
        """Tell whether every configuration within a travel of `clearance` [m] of this one (8,) keeps every margin."""
        return not pin.computeCollisions(self.model, self._data, self._manager(clearance)[1], q, True)

    def clearance_shares(self, joint: int) -> tuple[float, float]:
        """Return the shares of bodies on a joint: against what stands still, and against what the torso lifts too."""
        return float(self._share_by_joint[0, joint]), float(self._share_by_joint[1, joint])

    def travel_between(self, difference: FloatArray) -> float:
        """Return the travel [m] of a change (8,) of the joints, see the module."""
        return float((np.abs(difference) @ self._travel_per_joint).max())

    def travel_along(self, points: FloatArray) -> FloatArray:
        """Return the travel (N,) [m] along a path (N, 8) from its start to each of its points."""
        steps = (np.abs(np.diff(points, axis=0)) @ self._travel_per_joint).max(axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])
