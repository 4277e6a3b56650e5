# SPDX-License-Identifier: Apache-2.0
"""What a place should be like, as costs over centres of the moved object (free_place_search.Cost)."""

from __future__ import annotations

import re

import numpy as np
import shapely
from shapely.geometry import Polygon
from uncom_common.transforms import FloatArray
from uncom_language.types import Reference, Relation

from uncom_reasoner.detector_phrases import is_table
from uncom_reasoner.exceptions import NoPlaceError
from uncom_reasoner.gesture_types import TablePoint
from uncom_reasoner.support.free_place_search import NO_TABLE, Cost
from uncom_reasoner.support.options import PLACE_COST, PlaceCostOptions
from uncom_reasoner.support.spatial_relations import RelationGoal
from uncom_reasoner.support.support_plane import Surface, as_polygon, find_centre

AREA_HEADS = frozenset(
    ("corner", "middle", "center", "centre", "edge", "side", "left", "right", "front", "back", "end")
)
# other words for the same parts, and relations to the support itself ("to the left of the table" is on its left side)
AREA_SYNONYMS = {"center": "middle", "centre": "middle", "near": "front", "far": "back", "rear": "back"}
PART_OF_TABLE = re.compile(r"\b(middle|center|centre|corner|edge|side|end|front|back) of (?:the|this|that) \w+$")
RELATION_AREAS = {
    Relation.BETWEEN: "middle",  # "in the middle of the table"
    Relation.LEFT_OF: "left",
    Relation.RIGHT_OF: "right",
    Relation.IN_FRONT_OF: "front",
    Relation.BEHIND: "back",
}


def pointed_cost(point: TablePoint, surface: Surface, options: PlaceCostOptions = PLACE_COST) -> Cost:
    """Return the cost of the distance from where a gesture meets the support, in its own spread; far away fails."""
    # Half plain distance: the place named by a steady finger is the point itself, not anywhere in its spread.
    unit = surface.units_per_m
    inverse = np.linalg.inv(point.covariance)

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001 (a Cost takes both)
        offset = points - point.mean
        distance = np.linalg.norm(offset, axis=1) / unit
        spread = np.einsum("ni,ij,nj->n", offset, inverse, offset)
        return np.where(distance <= options.pointed_max_m, spread + (distance / options.pointed_sigma_m) ** 2, np.inf)

    return cost


def exact_cost(
    goal: FloatArray, surface: Surface, max_distance: float | None = None, options: PlaceCostOptions = PLACE_COST
) -> Cost:
    """Return the cost of the distance from one place; farther than max_distance (plane units) fails."""
    unit, limit = surface.units_per_m, options.exact_max_m if max_distance is None else max_distance

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        distance = np.linalg.norm(points - goal, axis=1)
        return np.asarray(np.where(distance <= limit, (distance / unit / options.exact_sigma_m) ** 2, np.inf))

    return cost


def related_cost(goal: RelationGoal, point: TablePoint | None, options: PlaceCostOptions = PLACE_COST) -> Cost:
    """Return the cost of a relation; a gesture beside the reference says which side or distance is meant."""
    unit = goal.surface.units_per_m
    beside = point is not None and not goal.reference.buffer(options.beside_margin_m * unit).contains(
        shapely.Point(*point.mean)
    )

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:
        costs = goal.costs(points, moved)
        if beside and point is not None:
            costs = costs + (np.linalg.norm(points - point.mean, axis=1) / unit / options.beside_sigma_m) ** 2
        return np.asarray(costs)

    return cost


def anywhere_cost(start: FloatArray, surface: Surface, options: PlaceCostOptions = PLACE_COST) -> Cost:
    """Return the cost of "on the table": some way from where the object is (start (2,)), in easy reach.

    The object would not have to be moved else.
    """
    unit = surface.units_per_m

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        moved_by = np.linalg.norm(points - start, axis=1) / unit
        costs = ((moved_by - options.elsewhere_m) / options.elsewhere_sigma_m) ** 2
        if surface.shoulders:
            shoulders = np.array(surface.shoulders)
            reach = np.linalg.norm(points[:, None, :] - shoulders, axis=2).min(axis=1)
            costs = costs + (np.maximum(reach - options.easy_reach_m, 0.0) / options.easy_reach_sigma_m) ** 2
        return np.asarray(np.where(moved_by >= options.elsewhere_min_share * options.elsewhere_m, costs, np.inf))

    return cost


def area_words(reference: Reference, relation: Relation, text: str = "") -> frozenset[str]:
    """Return the words that name a part of the support, from the reference and from a relation to the support.

    `text` is the whole command: "in the middle of the table" may have left only the table in the reference.
    """
    said = {reference.head.lower(), *(m.lower() for m in reference.modifiers), *reference.text.lower().split()}
    words = said & AREA_HEADS | {AREA_SYNONYMS[word] for word in said if word in AREA_SYNONYMS}
    if is_table(reference) and relation in RELATION_AREAS:
        words |= {RELATION_AREAS[relation]}
    named = PART_OF_TABLE.search(text.lower())
    if is_table(reference) and not words and named is not None:
        words = {AREA_SYNONYMS.get(named[1], named[1])}
    return frozenset(words)


def area_cost(
    words: frozenset[str], surface: Surface, point: TablePoint | None, options: PlaceCostOptions = PLACE_COST
) -> Cost:
    """Return the cost of an absolute area of the support: "in the corner", "in the middle", "on the left side".

    Raises:
        NoPlaceError: no table was seen.
    """
    if surface.polygon is None:
        raise NoPlaceError(NO_TABLE)
    ideals = _ideal_points(words, surface, surface.polygon, options)
    if point is not None and len(ideals) > 1:
        ideals = ideals[[int(np.argmin(np.linalg.norm(ideals - point.mean, axis=1)))]]
    unit = surface.units_per_m

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        distance = np.linalg.norm(points[:, None, :] - ideals[None, :, :], axis=2).min(axis=1) / unit
        return np.asarray(np.where(distance <= options.pointed_max_m, (distance / options.area_sigma_m) ** 2, np.inf))

    return cost


def _ideal_points(words: frozenset[str], surface: Surface, outline: Polygon, options: PlaceCostOptions) -> FloatArray:
    """Return the points (N, 2) that an area's name may mean."""
    centre = find_centre(outline)
    frame = np.asarray(as_polygon(outline.minimum_rotated_rectangle).exterior.coords)[:-1]
    directions = {"left": -surface.right, "right": surface.right, "front": -surface.far, "back": surface.far}
    if "middle" in words:
        return centre[None, :]
    if "corner" in words:
        points = centre + options.corner_share * (frame - centre)
    else:
        points = centre + options.side_share * ((frame + np.roll(frame, -1, axis=0)) / 2.0 - centre)
    for word in sorted(words & set(directions)):
        along = (points - centre) @ directions[word]
        points = points[along > options.side_selection * along.max()]
    return points
