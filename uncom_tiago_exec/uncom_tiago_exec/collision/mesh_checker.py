# SPDX-License-Identifier: Apache-2.0
"""The close look at a configuration: every pair of shapes by the meshes and solids themselves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.clearance_maps import ClearanceMap
from uncom_tiago_exec.types import FloatArray


class MeshChecker:
    """Looks at the pairs of one group in one scene; the first of the pairs are the group's body_pairs."""

    def __init__(
        self, group: ArmGroup, added: Sequence[Any], pairs: Sequence[tuple[int, int]], margins: Sequence[float]
    ) -> None:
        """Build the broad phase (about 1 ms) for the group's shapes and what is added to them."""
        self._model = group.model
        self._geometry = group.geometry.copy()
        for thing in added:
            self._geometry.addGeometryObject(thing)
        self._geometry.removeAllCollisionPairs()
        for i, j in pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(i, j))
        self._margins = list(margins)
        self._data = self._model.createData()
        self._gdata = self._geometry.createData()
        self.lower(margins)
        self._mapped: list[tuple[int, ClearanceMap]] = []
        for k, pair in enumerate(group.body_pairs):
            clearance = group.clearance_maps.get(pair)
            if clearance is not None:
                self._gdata.deactivateCollisionPair(k)
                if clearance.smallest_m <= self._margins[k]:
                    self._mapped.append((k, clearance))
        self._manager = pin.TreeBroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._model, self._geometry, self._gdata
        )

    def lower(self, margins: Sequence[float]) -> None:
        """Set the margins anew; none may be greater than before, for the broad phase is made for the first ones."""
        self._margins = list(margins)
        for request, margin in zip(self._gdata.collisionRequests, self._margins, strict=True):
            request.security_margin = margin

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps every margin."""
        if pin.computeCollisions(self._model, self._data, self._manager, q, True):
            return False
        for k, clearance in self._mapped:
            if clearance.clearance_at(q) <= self._margins[k] and pin.computeCollision(self._geometry, self._gdata, k):
                return False
        return True

    def violations(self, q: FloatArray) -> list[int]:
        """Return which pairs do not keep their margin at a configuration (8,)."""
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._gdata, q)
        pin.computeCollisions(self._geometry, self._gdata, False)
        active = self._gdata.activeCollisionPairs  # those with a map are not among them
        found = [k for k, r in enumerate(self._gdata.collisionResults) if active[k] and r.isCollision()]
        return found + [k for k, _ in self._mapped if pin.computeCollision(self._geometry, self._gdata, k)]

    def distance(self, k: int) -> float:
        """Return how far the shapes of a pair are apart [m] at the configuration looked at last."""
        pair = self._geometry.collisionPairs[k]
        sides = (pair.first, pair.second)
        first, second = (self._geometry.geometryObjects[i].geometry for i in sides)
        places = [coal.Transform3s(self._gdata.oMg[i].rotation, self._gdata.oMg[i].translation) for i in sides]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        return float(coal.distance(first, places[0], second, places[1], request, result))


def convex_checker_margins(group: ArmGroup, margins: Sequence[float]) -> FloatArray:
    """Return the margins (P,) of a checker's pairs, negative where a map tells that they are always kept."""
    asked = np.array(margins)
    for k, pair in enumerate(group.body_pairs):
        clearance = group.clearance_maps.get(pair)
        if clearance is not None and clearance.smallest_m > asked[k]:
            asked[k] = -1.0
    return asked
