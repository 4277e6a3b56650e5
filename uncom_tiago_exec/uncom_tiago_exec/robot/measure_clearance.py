# SPDX-License-Identifier: Apache-2.0
"""Measures how near shapes of the robot come that two joints lie between, and keeps the maps in a file.

The file is made anew for a robot description by:
    python -m uncom_tiago_exec.robot.measure_clearance URDF_FILE
"""

from __future__ import annotations

import base64
import json
import sys
import zlib
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pinocchio.utils

from uncom_tiago_exec.robot.arm_group import ArmGroup
from uncom_tiago_exec.robot.clearance import FILE, joints_between
from uncom_tiago_exec.robot.options import CLEARANCE_MAP, ClearanceMapOptions
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.types import SIDES


def measure(group: ArmGroup, *, options: ClearanceMapOptions = CLEARANCE_MAP) -> list[dict[str, object]]:
    """Measure the maps of all pairs of a group's shapes that two joints lie between."""
    geometry, model = group.geometry.copy(), group.model
    objects = list(geometry.geometryObjects)
    pairs = [
        (i, j)
        for i, j in group.body_pairs
        if abs(objects[i].parentJoint - objects[j].parentJoint) == options.joints_between
        and objects[i].name.startswith("torso_")
    ]  # of what goes up with the torso, head and other arm may stand otherwise when the map is used
    entries: list[dict[str, object]] = []
    data, gdata = model.createData(), geometry.createData()
    for i, j in pairs:
        places, low, per_cell = joints_between(model, geometry, i, j)
        moves = _farthest_moves(
            group, i if objects[i].parentJoint > objects[j].parentJoint else j, per_cell, options=options
        )
        values = []
        q = np.array(pin.neutral(model))
        for row in range(options.cells):
            for column in range(options.cells):
                q[list(places)] = [low[0] + (row + 0.5) / per_cell[0], low[1] + (column + 0.5) / per_cell[1]]
                pin.updateGeometryPlacements(model, data, geometry, gdata, q)
                left = _distance(objects, gdata, i, j) - moves
                values.append(int(np.clip(left / options.unit_m, 0.0, 255.0)))
        packed = base64.b64encode(zlib.compress(bytes(values), 9)).decode("ascii")
        entries.append({"shapes": [objects[i].name, objects[j].name], "millimetres": packed})
    return entries


def _distance(objects: list[Any], gdata: Any, i: int, j: int) -> float:
    placements = [coal.Transform3s(gdata.oMg[k].rotation, gdata.oMg[k].translation) for k in (i, j)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(objects[i].geometry, placements[0], objects[j].geometry, placements[1], request, result))


def _farthest_moves(
    group: ArmGroup, shape: int, per_cell: tuple[float, float], *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> float:
    """Return how far a corner of the outer shape can move within half a cell [m]: its lever times the angle."""
    model, thing = group.model, group.geometry.geometryObjects[shape]
    corners = np.array(thing.geometry.vertices()) @ thing.placement.rotation.T + thing.placement.translation
    second = float(np.hypot(corners[:, 0], corners[:, 1]).max())
    outer = model.jointPlacements[thing.parentJoint]
    first = 0.0
    for angle in np.linspace(-np.pi, np.pi, 256):
        turned = corners @ pin.utils.rotate("z", float(angle)).T @ outer.rotation.T + outer.translation
        first = max(first, float(np.hypot(turned[:, 0], turned[:, 1]).max()))
    return 0.5 * (first / per_cell[0] + second / per_cell[1]) + options.slack_m


def main(argv: list[str], *, options: ClearanceMapOptions = CLEARANCE_MAP) -> int:
    """Write the file for a robot description given as a file."""
    if len(argv[1:]) != 1:
        sys.stderr.write("use: python -m uncom_tiago_exec.robot.measure_clearance URDF_FILE\n")
        return 2
    FILE.unlink(missing_ok=True)
    robot = RobotModel(Path(argv[1]).read_text(encoding="utf-8"))
    entries = [entry for side in SIDES for entry in measure(robot.group(side, {}), options=options)]
    command = (
        f"python -m uncom_tiago_exec.robot.measure_clearance URDF_FILE  # {options.cells} by {options.cells} cells"
    )
    FILE.write_text(json.dumps({"command": command, "pairs": entries}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
