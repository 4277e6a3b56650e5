# SPDX-License-Identifier: Apache-2.0
"""How near two shapes of the robot can be where only two joints lie between them: a map instead of a check.

A cell of the map holds what is surely left between the two shapes for any two angles inside it: the distance at its
middle, less the farthest that a point can move from there. Where that is more than a margin, no check is needed;
elsewhere the shapes themselves are looked at. The file is made by measure_clearance.py.
"""

from __future__ import annotations

import base64
import json
import zlib
from dataclasses import dataclass
from functools import lru_cache
from math import floor
from pathlib import Path
from typing import Any

from uncom_tiago_exec.robot.options import CLEARANCE_MAP, ClearanceMapOptions
from uncom_tiago_exec.types import FloatArray

FILE = Path(__file__).parents[1] / "config" / "clearance.json"


@dataclass(frozen=True, slots=True)
class Clearance:
    """Least distances [m] (CELLS rows of the first joint, CELLS columns of the second) and where the cells lie."""

    least: tuple[tuple[float, ...], ...]
    joints: tuple[int, int]  # places of the two in a joint vector
    low: tuple[float, float]
    per_cell: tuple[float, float]  # cells for each radian
    smallest: float  # of all cells [m]

    def at(self, q: FloatArray) -> float:
        """Return what is surely left between the two at a joint vector [m]; 0 outside of the map."""
        row = floor((q[self.joints[0]] - self.low[0]) * self.per_cell[0])
        column = floor((q[self.joints[1]] - self.low[1]) * self.per_cell[1])
        return self.least[row][column] if 0 <= row < CLEARANCE_MAP.cells and 0 <= column < CLEARANCE_MAP.cells else 0.0


@lru_cache(maxsize=1)
def _as_lists(*, options: ClearanceMapOptions = CLEARANCE_MAP) -> dict[frozenset[str], tuple[tuple[float, ...], ...]]:
    if not FILE.is_file():
        return {}  # all pairs are looked at
    entries = json.loads(FILE.read_text(encoding="utf-8"))["pairs"]
    return {
        frozenset(entry["shapes"]): _rows(zlib.decompress(base64.b64decode(entry["millimetres"])), options=options)
        for entry in entries
    }


def _rows(values: bytes, *, options: ClearanceMapOptions = CLEARANCE_MAP) -> tuple[tuple[float, ...], ...]:
    return tuple(
        tuple(options.unit_m * v for v in values[k * options.cells : (k + 1) * options.cells])
        for k in range(options.cells)
    )


def clearances(
    model: Any, geometry: Any, pairs: tuple[tuple[int, int], ...], *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> dict[tuple[int, int], Clearance]:
    """Return the maps of those pairs of shapes that have one."""
    names = [g.name for g in geometry.geometryObjects]
    found = {}
    for i, j in pairs:
        least = _as_lists(options=options).get(frozenset((names[i], names[j])))
        if least is not None:
            found[i, j] = Clearance(
                least, *joints_between(model, geometry, i, j, options=options), min(map(min, least))
            )
    return found


def joints_between(
    model: Any, geometry: Any, i: int, j: int, *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> tuple[tuple[int, int], tuple[float, float], tuple[float, float]]:
    """Return places, lower limits and cells per radian of the two joints between two shapes."""
    last = max(geometry.geometryObjects[i].parentJoint, geometry.geometryObjects[j].parentJoint)
    places = (int(model.joints[last - 1].idx_q), int(model.joints[last].idx_q))
    low = (float(model.lowerPositionLimit[places[0]]), float(model.lowerPositionLimit[places[1]]))
    spans = (float(model.upperPositionLimit[k]) - float(model.lowerPositionLimit[k]) for k in places)
    first, second = (options.cells / span for span in spans)
    return places, low, (first, second)
