# SPDX-License-Identifier: Apache-2.0
"""Exact collision checks: every pair of shapes with the convex hulls of the meshes and the solids themselves."""

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
    """Checks the pairs of one group in one scene; pairs that have a clearance map are looked up before."""

    def __init__(
        self, group: ArmGroup, added: Sequence[Any], pairs: Sequence[tuple[int, int]], margins: Sequence[float]
    ) -> None:
        """Build the collision model and its broad phase, which takes about 1 ms.

        Args:
            group: whose configurations are checked.
            added: obstacles and held solids as pinocchio geometry objects; their indices follow those of the group.
            pairs: of shapes to check (P); the first of them are the body_pairs of the group.
            margins: least distances of those pairs (P,) [m].
        """
        self._model = group.model
        self._geometry = group.geometry.copy()
        for solid in added:
            self._geometry.addGeometryObject(solid)
        self._geometry.removeAllCollisionPairs()
        for i, j in pairs:
            self._geometry.addCollisionPair(pin.CollisionPair(i, j))
        self._margins = list(margins)
        self._data = self._model.createData()
        self._gdata = self._geometry.createData()
        self.lower_margins(margins)
        self._mapped: list[tuple[int, ClearanceMap]] = []
        for k, pair in enumerate(group.body_pairs):
            clearance_map = group.clearance_maps.get(pair)
            if clearance_map is not None:
                self._gdata.deactivateCollisionPair(k)
                if clearance_map.smallest_m <= self._margins[k]:
                    self._mapped.append((k, clearance_map))
        self._manager = pin.TreeBroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._model, self._geometry, self._gdata
        )

    def lower_margins(self, margins: Sequence[float]) -> None:
        """Set new margins (P,) [m]; none may be greater than before, as the broad phase is made for the first ones."""
        self._margins = list(margins)
        for request, margin in zip(self._gdata.collisionRequests, self._margins, strict=True):
            request.security_margin = margin

    def is_free(self, q: FloatArray) -> bool:
        """Tell whether a configuration (8,) keeps every margin."""
        if pin.computeCollisions(self._model, self._data, self._manager, q, True):
            return False
        for k, clearance_map in self._mapped:
            if clearance_map.clearance_at(q) <= self._margins[k] and pin.computeCollision(
                self._geometry, self._gdata, k
            ):
                return False
        return True

    def violations(self, q: FloatArray) -> list[int]:
        """Return the numbers of the pairs that do not keep their margin at a configuration (8,)."""
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._gdata, q)
        pin.computeCollisions(self._geometry, self._gdata, False)
        active = self._gdata.activeCollisionPairs  # those with a map are not among them
        found = [k for k, r in enumerate(self._gdata.collisionResults) if active[k] and r.isCollision()]
        return found + [k for k, _ in self._mapped if pin.computeCollision(self._geometry, self._gdata, k)]

    def distance(self, k: int) -> float:
        """Return the distance of the shapes of pair k [m] at the configuration that was checked last."""
        pair = self._geometry.collisionPairs[k]
        sides = (pair.first, pair.second)
        first, second = (self._geometry.geometryObjects[i].geometry for i in sides)
        placements = [coal.Transform3s(self._gdata.oMg[i].rotation, self._gdata.oMg[i].translation) for i in sides]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        return float(coal.distance(first, placements[0], second, placements[1], request, result))


def convex_checker_margins(group: ArmGroup, margins: Sequence[float]) -> FloatArray:
    """Return the margins (P,) [m] for a ConvexChecker: negative for pairs whose map never falls below their margin."""
    required = np.array(margins)
    for k, pair in enumerate(group.body_pairs):
        clearance_map = group.clearance_maps.get(pair)
        if clearance_map is not None and clearance_map.smallest_m > required[k]:
            required[k] = -1.0
    return required
