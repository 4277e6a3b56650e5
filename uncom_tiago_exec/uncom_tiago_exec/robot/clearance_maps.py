# SPDX-License-Identifier: Apache-2.0
r"""Precomputed lower bounds of the distance between two shapes of the robot that only two joints lie between.

The distance d of such a pair is a function of two joint angles. A map divides their ranges into cells; a cell around
the angles (a, b) with half widths (h1, h2) stores

$$d(a, b) - (h_1 r_1 + h_2 r_2),$$

where r1 and r2 are the greatest distances of a point of the outer shape from the two joint axes: no point of it moves
farther than that within the cell, so the stored value is a lower bound for every angle in it. Where the bound exceeds
the margin of the pair no collision check is needed. The file is made by measure_clearance.py.
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

CLEARANCE_FILE = Path(__file__).parents[1] / "config" / "clearance.json"
DistanceRows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class ClearanceMap:
    """Lower bounds of the distance of one pair of shapes over the angles of two joints.

    Attributes:
        distances_m: one bound a cell [m]; rows are cells of the first joint, columns of the second.
        joint_indices: positions of the two joints in a joint vector.
        lower_rad: lower limits of the two joints, where the map begins [rad].
        cells_per_rad: cells for each radian of the two joints.
        smallest_m: the least bound of all cells [m].
    """

    distances_m: DistanceRows
    joint_indices: tuple[int, int]
    lower_rad: tuple[float, float]
    cells_per_rad: tuple[float, float]
    smallest_m: float

    def clearance_at(self, q: FloatArray) -> float:
        """Return a lower bound [m] of the distance at a joint vector (8,); 0 outside of the map."""
        row = floor((q[self.joint_indices[0]] - self.lower_rad[0]) * self.cells_per_rad[0])
        column = floor((q[self.joint_indices[1]] - self.lower_rad[1]) * self.cells_per_rad[1])
        cells = len(self.distances_m)
        return self.distances_m[row][column] if 0 <= row < cells and 0 <= column < cells else 0.0


@lru_cache(maxsize=1)
def _load_distances(*, options: ClearanceMapOptions = CLEARANCE_MAP) -> dict[frozenset[str], DistanceRows]:
    """Return the distances of all pairs in the file, by the names of their two shapes; none if there is no file."""
    if not CLEARANCE_FILE.is_file():
        return {}
    entries = json.loads(CLEARANCE_FILE.read_text(encoding="utf-8"))["pairs"]
    return {
        frozenset(entry["shapes"]): _decode(zlib.decompress(base64.b64decode(entry["millimetres"])), options=options)
        for entry in entries
    }


def _decode(values: bytes, *, options: ClearanceMapOptions = CLEARANCE_MAP) -> DistanceRows:
    """Return the rows of distances [m] that the bytes of an entry of the file stand for."""
    return tuple(
        tuple(options.unit_m * v for v in values[k * options.cells : (k + 1) * options.cells])
        for k in range(options.cells)
    )


def load_clearance_maps(
    model: Any, geometry: Any, pairs: tuple[tuple[int, int], ...], *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> dict[tuple[int, int], ClearanceMap]:
    """Return the maps of those pairs of shapes (indices in the pinocchio geometry) that the file has one for."""
    names = [g.name for g in geometry.geometryObjects]
    found = {}
    for i, j in pairs:
        distances = _load_distances(options=options).get(frozenset((names[i], names[j])))
        if distances is not None:
            axes = map_axes(model, geometry, i, j, options=options)
            found[i, j] = ClearanceMap(distances, *axes, min(map(min, distances)))
    return found


def map_axes(
    model: Any, geometry: Any, i: int, j: int, *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> tuple[tuple[int, int], tuple[float, float], tuple[float, float]]:
    """Return the axes of the map of shapes i and j, which two joints lie between.

    Returns:
        Positions of the two joints in a joint vector, their lower limits [rad], and cells for each radian.
    """
    outer = max(geometry.geometryObjects[i].parentJoint, geometry.geometryObjects[j].parentJoint)
    indices = (int(model.joints[outer - 1].idx_q), int(model.joints[outer].idx_q))
    lower = (float(model.lowerPositionLimit[indices[0]]), float(model.lowerPositionLimit[indices[1]]))
    spans = (float(model.upperPositionLimit[k]) - float(model.lowerPositionLimit[k]) for k in indices)
    first, second = (options.cells / span for span in spans)
    return indices, lower, (first, second)
