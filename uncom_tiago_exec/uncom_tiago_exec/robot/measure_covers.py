# SPDX-License-Identifier: Apache-2.0
"""Cuts the collision meshes of the robot into convex bodies with few corners (convex_covers.py), and writes a file.

The file is made for a robot description by:
    python -m uncom_tiago_exec.robot.measure_covers URDF_FILE
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import coal
import numpy as np

from uncom_tiago_exec.robot.convex_covers import COVERS_FILE, convex_hull, mesh_hash, reduce_corners
from uncom_tiago_exec.robot.options import CONVEX_COVERS, ConvexCoverOptions
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.types import FloatArray

_SHOULDER_LINKS = re.compile(r"arm_\w+_[12]_")

Body = tuple[FloatArray, float]


def split_hull(
    corners: FloatArray, radius: float, cuts: int | None = None, *, options: ConvexCoverOptions = CONVEX_COVERS
) -> list[Body]:
    """Return the bodies that cover a convex hull, as few as reach a radius.

    The hull is cut in two where the larger radius of the halves becomes least (planes across its principal axes and
    the coordinate axes), and the halves are cut again until the radius is reached or no cuts are left.

    Args:
        corners: of the hull (N, 3) [m].
        radius: at which a body is good enough [m].
        cuts: depth of cuts still allowed; that of the options if None.
        options: numbers that tune it.

    Returns:
        Corners (M, 3) and radius [m] of each body.
    """
    whole = reduce_corners(corners, options=options)
    cuts = options.cuts if cuts is None else cuts
    if cuts == 0 or whole[1] <= radius:
        return [whole]
    axes = [*np.linalg.svd(corners - corners.mean(axis=0))[2], *np.eye(3)]
    best: list[Body] = [whole]
    halves: tuple[FloatArray, FloatArray] | None = None
    for axis in axes:
        along = corners @ axis
        for share in options.cut_shares:
            parts = split_at_plane(corners, axis, float(along.min() + share * np.ptp(along)) + 1e-6)
            tried = [reduce_corners(part, options=options) for part in parts]
            if max(r for _, r in tried) < max(r for _, r in best):
                best, halves = tried, parts
    if halves is None or max(r for _, r in best) <= radius:
        return best
    return [body for half in halves for body in split_hull(half, radius, cuts - 1, options=options)]


def target_radius(name: str, *, options: ConvexCoverOptions = CONVEX_COVERS) -> float:
    """Return the radius [m] at which the covers of a shape of this name are good enough."""
    if not name.startswith("arm_"):
        return options.coarse_m
    return options.shoulder_m if _SHOULDER_LINKS.match(name) else options.arm_m


def split_at_plane(corners: FloatArray, axis: FloatArray, offset: float) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the two parts of a hull (N, 3) on both sides of the plane axis . x = offset."""
    side = corners @ axis - offset
    first, second = np.triu_indices(len(corners), 1)  # the section of a hull is that of all lines between corners
    crossing = side[first] * side[second] < 0.0
    first, second = first[crossing], second[crossing]
    share = (side[first] / (side[first] - side[second]))[:, None]
    section = corners[first] + (corners[second] - corners[first]) * share
    upper, lower = (np.vstack([corners[sign * side >= 0.0], section]) for sign in (1.0, -1.0))
    return convex_hull(upper), convex_hull(lower)


def main(argv: list[str], *, options: ConvexCoverOptions = CONVEX_COVERS) -> int:
    """Write the file for the URDF file named on the command line; return the exit status."""
    if len(argv[1:]) != 1:
        sys.stderr.write("use: python -m uncom_tiago_exec.robot.measure_covers URDF_FILE\n")
        return 2
    robot = RobotModel(Path(argv[1]).read_text(encoding="utf-8"))
    meshes: dict[str, list[dict[str, object]]] = {}
    for geometry in robot.geometry.geometryObjects:
        if isinstance(geometry.geometry, coal.BVHModelBase):
            vertices = np.array(geometry.geometry.vertices())
            radius = target_radius(geometry.name, options=options)
            meshes[mesh_hash(vertices)] = [
                {"radius": round(r + options.slack_m, 6), "corners": np.round(corners, 6).tolist()}
                for corners, r in split_hull(convex_hull(vertices), radius, options=options)
            ]
    command = "python -m uncom_tiago_exec.robot.measure_covers URDF_FILE"
    text = json.dumps({"command": command, "meshes": meshes}, separators=(",", ":"))
    COVERS_FILE.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
