# SPDX-License-Identifier: Apache-2.0
"""What a place should be like, as costs over centres of the moved thing (placing.Cost)."""

from __future__ import annotations

import re
from typing import cast

import numpy as np
import shapely
from shapely.geometry import Polygon
from uncom_language.types import Reference, Relation

from uncom_reasoner.detector_phrases import is_table
from uncom_reasoner.support.free_place_search import Cost
from uncom_reasoner.support.spatial_relations import RelationGoal
from uncom_reasoner.support.support_plane import Surface, centre_of
from uncom_reasoner.types import FloatArray, TablePoint

FARTHEST_POINTED_M = 0.25
ELSEWHERE_M = 0.2
AREA_HEADS = frozenset(
    ("corner", "middle", "center", "centre", "edge", "side", "left", "right", "front", "back", "end")
)


# other words for the same parts, and relations to the support itself ("to the left of the table" is on its left side)
WAYS = {"center": "middle", "centre": "middle", "near": "front", "far": "back", "rear": "back"}
PART_OF_TABLE = re.compile(r"\b(middle|center|centre|corner|edge|side|end|front|back) of (?:the|this|that) \w+$")
RELATION_AREAS = {
    Relation.BETWEEN: "middle",  # "in the middle of the table"
    Relation.LEFT_OF: "left",
    Relation.RIGHT_OF: "right",
    Relation.IN_FRONT_OF: "front",
    Relation.BEHIND: "back",
}


def pointed_cost(point: TablePoint, surface: Surface) -> Cost:
    """Cost of the distance from where a gesture meets the support, in its own uncertainty; far away fails."""
    # Half plain distance: the place named by a steady finger is the point itself, not anywhere in its spread.
    unit = surface.unit
    inverse = np.linalg.inv(point.covariance)

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001 (a Cost takes both)
        offset = points - point.mean
        distance = np.linalg.norm(offset, axis=1) / unit
        spread = np.einsum("ni,ij,nj->n", offset, inverse, offset)
        return np.where(distance <= FARTHEST_POINTED_M, spread + (distance / 0.03) ** 2, np.inf)

    return cost


def exact_cost(goal: FloatArray, surface: Surface, farthest: float = 0.08) -> Cost:
    """Cost of the distance from one place; farther than `farthest` (plane units) fails."""
    unit = surface.unit

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        distance = np.linalg.norm(points - goal, axis=1)
        return np.asarray(np.where(distance <= farthest, (distance / unit / 0.02) ** 2, np.inf))

    return cost


def related_cost(goal: RelationGoal, point: TablePoint | None) -> Cost:
    """Cost of a relation; a gesture beside the reference says which side or distance is meant."""
    unit = goal.surface.unit
    beside = point is not None and not goal.reference.buffer(0.01 * unit).contains(shapely.Point(*point.mean))

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:
        costs = goal.costs(points, moved)
        if beside and point is not None:
            costs = costs + (np.linalg.norm(points - point.mean, axis=1) / unit / 0.08) ** 2
        return np.asarray(costs)

    return cost


def anywhere_cost(start: FloatArray, surface: Surface) -> Cost:
    """Cost of "on the table": some way from where the thing is (it would not have to be moved else), in easy reach."""
    unit = surface.unit

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        moved_by = np.linalg.norm(points - start, axis=1) / unit
        costs = ((moved_by - ELSEWHERE_M) / 0.1) ** 2
        if surface.reach:
            shoulders = np.array(surface.reach)
            reach = np.linalg.norm(points[:, None, :] - shoulders, axis=2).min(axis=1)
            costs = costs + (np.maximum(reach - 0.6, 0.0) / 0.1) ** 2
        return np.asarray(np.where(moved_by >= 0.5 * ELSEWHERE_M, costs, np.inf))

    return cost


def area_words(reference: Reference, relation: Relation, text: str = "") -> frozenset[str]:
    """Return the words that name a part of the support, from the reference and from a relation to the support.

    `text` is the whole command: "in the middle of the table" may have left only the table in the reference.
    """
    said = {reference.head.lower(), *(m.lower() for m in reference.modifiers), *reference.text.lower().split()}
    words = said & AREA_HEADS | {WAYS[word] for word in said if word in WAYS}
    if is_table(reference) and relation in RELATION_AREAS:
        words |= {RELATION_AREAS[relation]}
    named = PART_OF_TABLE.search(text.lower())
    if is_table(reference) and not words and named is not None:
        words = {WAYS.get(named[1], named[1])}
    return frozenset(words)


def area_cost(words: frozenset[str], surface: Surface, point: TablePoint | None) -> Cost:
    """Cost of an absolute area of the support: "in the corner", "in the middle", "on the left side"."""
    assert surface.polygon is not None  # noqa: S101 (callers looked)
    ideals = _ideals(words, surface, surface.polygon)
    if point is not None and len(ideals) > 1:
        ideals = ideals[[int(np.argmin(np.linalg.norm(ideals - point.mean, axis=1)))]]
    unit = surface.unit

    def cost(points: FloatArray, moved: FloatArray) -> FloatArray:  # noqa: ARG001
        distance = np.linalg.norm(points[:, None, :] - ideals[None, :, :], axis=2).min(axis=1) / unit
        return np.asarray(np.where(distance <= FARTHEST_POINTED_M, (distance / 0.08) ** 2, np.inf))

    return cost


def _ideals(words: frozenset[str], surface: Surface, outline: Polygon) -> FloatArray:
    """Return the points (N, 2) that an area's name may mean."""
    centre = centre_of(outline)
    frame = np.asarray(cast("Polygon", outline.minimum_rotated_rectangle).exterior.coords)[:-1]
    ways = {"left": -surface.right, "right": surface.right, "front": -surface.far, "back": surface.far}
    if "middle" in words:
        return centre[None, :]
    if "corner" in words:
        points = centre + 0.8 * (frame - centre)
    else:
        points = centre + 0.6 * ((frame + np.roll(frame, -1, axis=0)) / 2.0 - centre)
    for word in sorted(words & set(ways)):
        along = (points - centre) @ ways[word]
        points = points[along > 0.3 * along.max()]
    return points
