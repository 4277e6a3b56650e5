# SPDX-License-Identifier: Apache-2.0
"""Refuses scenes whose objects are off the table or overlap."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from uncom_sim.exceptions import SceneError
from uncom_sim.objects.footprint import ground_point, outline
from uncom_sim.types import SceneObject, Table
from uncom_sim.world.options import PLACEMENT, PlacementOptions


def check_placement(objects: Sequence[SceneObject], table: Table, *, options: PlacementOptions = PLACEMENT) -> None:
    """Refuse objects that stand off the table or in one another.

    Raises:
        SceneError: names the object, or both.
    """
    for obj in objects:
        if not table.contains(*ground_point(obj), margin=options.edge_m):
            raise SceneError(
                f"object {obj.id!r} at ({obj.x:g}, {obj.y:g}) is not on the table: x must be between "
                f"{table.x_min:g} and {table.x_max:g}, y between {table.y_min:g} and {table.y_max:g}"
            )
    outlines = [outline(obj) for obj in objects]
    for (a, shape_a), (b, shape_b) in combinations(zip(objects, outlines, strict=True), 2):
        if shape_a.intersection(shape_b).area > options.overlap_m2:
            raise SceneError(f"objects {a.id!r} and {b.id!r} overlap; move one of them")
