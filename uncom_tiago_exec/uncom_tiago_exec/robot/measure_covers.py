# SPDX-License-Identifier: Apache-2.0
"""Cuts the collision meshes of a robot into convex bodies of few corners, and keeps them in a file (covers.py).

The file is made anew for a robot description by:
    python -m uncom_tiago_exec.robot.measure_covers URDF_FILE
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import coal
import numpy as np

from uncom_tiago_exec.robot.convex_covers import FILE, convex_hull, fewer, name_of
from uncom_tiago_exec.robot.options import CONVEX_COVERS, ConvexCoverOptions
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.types import FloatArray

# [m] radius that is small enough: of what is always near the shoulder, of the rest of an arm, and of all else
_FINE = {True: 0.0008, False: 0.0018}
_NEAR = re.compile(r"arm_\w+_[12]_")

Body = tuple[FloatArray, float]


def bodies_of(
    corners: FloatArray, fine: float, cuts: int | None = None, *, options: ConvexCoverOptions = CONVEX_COVERS
) -> list[Body]:
    """Return corners and radius of the bodies that hold a hull: as few as are fine [m], cut where it does most."""
    whole = fewer(corners)
    cuts = options.cuts if cuts is None else cuts
    if cuts == 0 or whole[1] <= fine:
        return [whole]
    axes = [*np.linalg.svd(corners - corners.mean(axis=0))[2], *np.eye(3)]
    best: list[Body] = [whole]
    halves: tuple[FloatArray, FloatArray] | None = None
    for axis in axes:
        along = corners @ axis
        for share in options.cut_shares:
            parts = cut(corners, axis, float(along.min() + share * np.ptp(along)) + 1e-6)
            tried = [fewer(part) for part in parts]
            if max(radius for _, radius in tried) < max(radius for _, radius in best):
                best, halves = tried, parts
    if halves is None or max(radius for _, radius in best) <= fine:
        return best
    return [body for half in halves for body in bodies_of(half, fine, cuts - 1, options=options)]


def fine_enough(name: str, *, options: ConvexCoverOptions = CONVEX_COVERS) -> float:
    """Return the radius [m] that the bodies of a shape need not be finer than."""
    return _FINE[_NEAR.match(name) is not None] if name.startswith("arm_") else options.coarse_m


def cut(corners: FloatArray, axis: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the two parts of a hull (N, 3) on both sides of the plane axis x = at."""
    side = corners @ axis - at
    first, second = np.triu_indices(len(corners), 1)  # the section of a hull is that of all lines between corners
    crossing = side[first] * side[second] < 0.0
    first, second = first[crossing], second[crossing]
    share = (side[first] / (side[first] - side[second]))[:, None]
    section = corners[first] + (corners[second] - corners[first]) * share
    upper, lower = (np.vstack([corners[sign * side >= 0.0], section]) for sign in (1.0, -1.0))
    return convex_hull(upper), convex_hull(lower)


def main(argv: list[str], *, options: ConvexCoverOptions = CONVEX_COVERS) -> int:
    """Write the file for a robot description given as a file."""
    if len(argv[1:]) != 1:
        sys.stderr.write("use: python -m uncom_tiago_exec.robot.measure_covers URDF_FILE\n")
        return 2
    robot = RobotModel(Path(argv[1]).read_text(encoding="utf-8"))
    meshes: dict[str, list[dict[str, object]]] = {}
    for geometry in robot.geometry.geometryObjects:
        if isinstance(geometry.geometry, coal.BVHModelBase):
            vertices = np.array(geometry.geometry.vertices())
            meshes[name_of(vertices)] = [
                {"radius": round(radius + options.slack_m, 6), "corners": np.round(corners, 6).tolist()}
                for corners, radius in bodies_of(
                    convex_hull(vertices), fine_enough(geometry.name, options=options), options=options
                )
            ]
    command = "python -m uncom_tiago_exec.robot.measure_covers URDF_FILE"
    FILE.write_text(json.dumps({"command": command, "meshes": meshes}, separators=(",", ":")) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
