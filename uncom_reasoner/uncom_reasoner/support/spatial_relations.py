# SPDX-License-Identifier: Apache-2.0
"""Spatial relations on the support, in metres: where a thing may go, and whether a thing is there.

Left and right, in front and behind follow `Surface.right` and `Surface.far`. A relation holds for a footprint only if
the whole of it lies on the right side of the reference with a gap, and within the cone of that direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from uncom_language.types import Relation

from uncom_reasoner.support.support_plane import Surface, centre_of
from uncom_reasoner.types import FloatArray

IDEAL_GAP_M = 0.05
SIDE_GAP_M = 0.30  # farther than this is no longer "left of"
NEXT_GAP_M = 0.12
NEAR_GAP_M = 0.25
CONE = 0.7  # offset across the direction for one along it (35 degrees)

DIRECTIONAL = (Relation.LEFT_OF, Relation.RIGHT_OF, Relation.IN_FRONT_OF, Relation.BEHIND)
RELATIVE = (*DIRECTIONAL, Relation.NEXT_TO, Relation.NEAR, Relation.BETWEEN)
FAILS = np.inf


def direction_of(relation: Relation, surface: Surface) -> FloatArray:
    """Return the unit direction (2,) that a relation asks for."""
    return {
        Relation.LEFT_OF: -surface.right,
        Relation.RIGHT_OF: surface.right,
        Relation.IN_FRONT_OF: -surface.far,
        Relation.BEHIND: surface.far,
    }[relation]


@dataclass(frozen=True)
class RelationGoal:
    """A relation to one reference outline, or to two for "between"; plane coordinates."""

    relation: Relation
    surface: Surface
    reference: Polygon
    reference2: Polygon | None = None
    gap_m: float = 0.0  # asked for in words ("ten centimetres left of"); 0: a usual one

    @property
    def _ideal_gap(self) -> float:
        return self.gap_m or IDEAL_GAP_M

    @property
    def _tolerance(self) -> float:
        return 0.02 if self.gap_m else 0.05

    def _farthest(self, usual: float) -> float:
        return max(usual, self.gap_m + 0.05) * self.surface.unit

    def costs(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        """Return a cost (N,) for the moved thing's centre at each point (N, 2); infinite where the relation fails.

        Args:
            points: centres to weigh (N, 2).
            moved: outline (M, 2) of the moved thing around its centre.
        """
        if self.relation in DIRECTIONAL:
            return self._directional(points, moved)
        if self.relation is Relation.BETWEEN and self.reference2 is not None:
            return self._between(points, moved, self.reference2)
        return self._beside(points, moved)

    def _directional(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        unit = self.surface.unit
        d = direction_of(self.relation, self.surface)
        outline = np.asarray(self.reference.exterior.coords)
        gap = (points @ d + float((moved @ d).min())) - float((outline @ d).max())
        offset = points - centre_of(self.reference)
        across = np.abs(offset @ np.array([-d[1], d[0]]))
        holds = (gap >= 0.0) & (gap <= self._farthest(SIDE_GAP_M)) & (across <= CONE * (offset @ d))
        cost = ((gap / unit - self._ideal_gap) / self._tolerance) ** 2 + (across / unit / 0.04) ** 2
        return np.where(holds, cost, FAILS)

    def _beside(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        unit = self.surface.unit
        farthest = NEXT_GAP_M if self.relation is Relation.NEXT_TO else NEAR_GAP_M
        gap = _gaps(points, moved, self.reference)
        offset = points - centre_of(self.reference)
        ahead = np.abs(offset @ self.surface.far) / np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
        cost = ((gap / unit - self._ideal_gap) / self._tolerance) ** 2 + ahead**2  # beside rather than before or behind
        return np.where((gap > 0.0) & (gap <= self._farthest(farthest)), cost, FAILS)

    def _between(self, points: FloatArray, moved: FloatArray, second: Polygon) -> FloatArray:
        a, b = centre_of(self.reference), centre_of(second)
        ab = b - a
        length = max(float(np.linalg.norm(ab)), 1e-9)
        along = (points - a) @ ab / length**2
        across = np.abs((points - a) @ np.array([-ab[1], ab[0]])) / length
        gaps = np.minimum(_gaps(points, moved, self.reference), _gaps(points, moved, second))
        holds = (along > 0.1) & (along < 0.9) & (across <= 0.3 * length) & (gaps > 0.0)
        cost = ((along - 0.5) / 0.15) ** 2 + (across / self.surface.unit / 0.04) ** 2
        return np.where(holds, cost, FAILS)


def _gaps(points: FloatArray, moved: FloatArray, reference: Polygon) -> FloatArray:
    """Return the distance (N,) between the moved outline at each point and a reference, 0 where they touch."""
    shapes = shapely.polygons([moved + p for p in points]) if len(points) else np.array([])
    return np.asarray(shapely.distance(shapes, reference), dtype=float)


def relation_log(
    relation: Relation, thing: Polygon, anchor: Polygon, surface: Surface, second: Polygon | None = None
) -> float:
    """Return how well a thing stands in a relation to an anchor, as a log factor (0 is best, about -8 is worst).

    `second` is the other anchor of "between".
    """
    unit = surface.unit
    if relation is Relation.BETWEEN and second is not None:
        return _between_log(thing, anchor, second, unit)
    gap = float(thing.distance(anchor)) / unit
    offset = (centre_of(thing) - centre_of(anchor)) / unit
    if relation in DIRECTIONAL:
        d = direction_of(relation, surface)
        along = float(offset @ d)
        across = abs(float(offset @ np.array([-d[1], d[0]])))
        side = -float(np.log1p(np.exp(-along / 0.02)))
        return max(side - 0.5 * (max(across - along, 0.0) / 0.08) ** 2 - gap / 0.3, -8.0)
    if relation in (Relation.ON, Relation.IN, Relation.UNDER):
        outside = float(thing.centroid.distance(anchor)) / unit
        return max(-0.5 * (outside / 0.02) ** 2, -8.0)
    scale = 0.25 if relation is Relation.NEAR else 0.12
    return max(-0.5 * (gap / scale) ** 2 - gap / scale, -8.0)


def _between_log(thing: Polygon, first: Polygon, second: Polygon, unit: float) -> float:
    a, b, p = centre_of(first), centre_of(second), centre_of(thing)
    length = max(float(np.linalg.norm(b - a)), 1e-9)
    along = float((p - a) @ (b - a)) / length**2
    across = abs(float((p - a) @ np.array([a[1] - b[1], b[0] - a[0]]))) / length
    beyond = max(-along, along - 1.0, 0.0) * length
    return max(-0.5 * (across / unit / 0.08) ** 2 - 0.5 * (beyond / unit / 0.03) ** 2 - 2.0 * abs(along - 0.5), -8.0)
