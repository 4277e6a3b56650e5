# SPDX-License-Identifier: Apache-2.0
"""Spatial relations on the support, in metres: where an object may go, and whether an object is there.

Left and right, in front and behind follow `Surface.right` and `Surface.far`. A relation holds for a footprint only if
the whole of it lies on the right side of the reference with a gap, and within the cone of that direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from uncom_common.transforms import FloatArray
from uncom_language.types import Relation

from uncom_reasoner.support.options import (
    RELATION_GOAL,
    RELATION_LIKELIHOOD,
    RelationGoalOptions,
    RelationLikelihoodOptions,
)
from uncom_reasoner.support.support_plane import Surface, find_centre

DIRECTIONAL = (Relation.LEFT_OF, Relation.RIGHT_OF, Relation.IN_FRONT_OF, Relation.BEHIND)
RELATIVE = (*DIRECTIONAL, Relation.NEXT_TO, Relation.NEAR, Relation.BETWEEN)


def relation_direction(relation: Relation, surface: Surface) -> FloatArray:
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
    options: RelationGoalOptions = RELATION_GOAL

    @property
    def _ideal_gap_m(self) -> float:
        return self.gap_m or self.options.usual_gap_m

    @property
    def _gap_sigma_m(self) -> float:
        return self.options.stated_gap_sigma_m if self.gap_m else self.options.usual_gap_sigma_m

    def _max_gap(self, usual_m: float) -> float:
        """Return the largest gap in plane units."""
        return max(usual_m, self.gap_m + self.options.stated_gap_margin_m) * self.surface.units_per_m

    def costs(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        """Return a cost (N,) for the moved object's centre at each point (N, 2); infinite where the relation fails.

        Args:
            points: centres to weigh (N, 2).
            moved: outline (M, 2) of the moved object around its centre.
        """
        if self.relation in DIRECTIONAL:
            return self._directional(points, moved)
        if self.relation is Relation.BETWEEN and self.reference2 is not None:
            return self._between(points, moved, self.reference2)
        return self._beside(points, moved)

    def _directional(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        unit, options = self.surface.units_per_m, self.options
        d = relation_direction(self.relation, self.surface)
        outline = np.asarray(self.reference.exterior.coords)
        gap = (points @ d + float((moved @ d).min())) - float((outline @ d).max())
        offset = points - find_centre(self.reference)
        across = np.abs(offset @ np.array([-d[1], d[0]]))
        in_cone = across <= options.cone_ratio * (offset @ d)
        holds = (gap >= 0.0) & (gap <= self._max_gap(options.side_gap_max_m)) & in_cone
        off_gap = (gap / unit - self._ideal_gap_m) / self._gap_sigma_m
        cost = off_gap**2 + (across / unit / options.across_sigma_m) ** 2
        return np.where(holds, cost, np.inf)

    def _beside(self, points: FloatArray, moved: FloatArray) -> FloatArray:
        unit, options = self.surface.units_per_m, self.options
        usual_m = options.next_to_gap_max_m if self.relation is Relation.NEXT_TO else options.near_gap_max_m
        gap = _measure_gaps(points, moved, self.reference)
        offset = points - find_centre(self.reference)
        ahead = np.abs(offset @ self.surface.far) / np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
        off_gap = (gap / unit - self._ideal_gap_m) / self._gap_sigma_m
        cost = off_gap**2 + ahead**2  # beside rather than before or behind
        return np.where((gap > 0.0) & (gap <= self._max_gap(usual_m)), cost, np.inf)

    def _between(self, points: FloatArray, moved: FloatArray, second: Polygon) -> FloatArray:
        options = self.options
        a, b = find_centre(self.reference), find_centre(second)
        ab = b - a
        length = max(float(np.linalg.norm(ab)), 1e-9)
        along = (points - a) @ ab / length**2
        across = np.abs((points - a) @ np.array([-ab[1], ab[0]])) / length
        gaps = np.minimum(_measure_gaps(points, moved, self.reference), _measure_gaps(points, moved, second))
        within = (along > options.between_min) & (along < options.between_max)
        holds = within & (across <= options.between_width_ratio * length) & (gaps > 0.0)
        off_middle = (along - 0.5) / options.between_sigma
        cost = off_middle**2 + (across / self.surface.units_per_m / options.across_sigma_m) ** 2
        return np.where(holds, cost, np.inf)


def _measure_gaps(points: FloatArray, moved: FloatArray, reference: Polygon) -> FloatArray:
    """Return the distance (N,) between the moved outline at each point and a reference, 0 where they touch."""
    shapes = shapely.polygons([moved + p for p in points]) if len(points) else np.array([])
    return np.asarray(shapely.distance(shapes, reference), dtype=float)


def relation_log_likelihood(
    relation: Relation,
    shape: Polygon,
    anchor: Polygon,
    surface: Surface,
    second: Polygon | None = None,
    options: RelationLikelihoodOptions = RELATION_LIKELIHOOD,
) -> float:
    """Return how well an object stands in a relation to an anchor, as a natural log (0 is best).

    Args:
        relation: that is asked about.
        shape: outline of the object on the plane.
        anchor: outline of what it is related to; `second` is the other one of "between".
        surface: the support.
        second: see `anchor`.
        options: of the likelihood; its `min_log` is the worst.
    """
    unit, least = surface.units_per_m, options.min_log
    if relation is Relation.BETWEEN and second is not None:
        return _between_log_likelihood(shape, anchor, second, unit, options)
    gap = float(shape.distance(anchor)) / unit
    offset = (find_centre(shape) - find_centre(anchor)) / unit
    if relation in DIRECTIONAL:
        d = relation_direction(relation, surface)
        along = float(offset @ d)
        across = abs(float(offset @ np.array([-d[1], d[0]])))
        side = -float(np.log1p(np.exp(-along / options.side_scale_m)))
        outside = max(across - along, 0.0) / options.cone_sigma_m
        return max(side - 0.5 * outside**2 - gap / options.side_gap_scale_m, least)
    if relation in (Relation.ON, Relation.IN, Relation.UNDER):
        distance = float(shape.centroid.distance(anchor)) / unit
        return max(-0.5 * (distance / options.inside_sigma_m) ** 2, least)
    scale = options.near_scale_m if relation is Relation.NEAR else options.next_to_scale_m
    return max(-0.5 * (gap / scale) ** 2 - gap / scale, least)


def _between_log_likelihood(
    shape: Polygon, first: Polygon, second: Polygon, unit: float, options: RelationLikelihoodOptions
) -> float:
    a, b, p = find_centre(first), find_centre(second), find_centre(shape)
    length = max(float(np.linalg.norm(b - a)), 1e-9)
    along = float((p - a) @ (b - a)) / length**2
    across = abs(float((p - a) @ np.array([a[1] - b[1], b[0] - a[0]]))) / length
    beyond = max(-along, along - 1.0, 0.0) * length
    log = -0.5 * (across / unit / options.between_across_sigma_m) ** 2
    log = log - 0.5 * (beyond / unit / options.between_beyond_sigma_m) ** 2
    return max(log - options.between_off_middle * abs(along - 0.5), options.min_log)
