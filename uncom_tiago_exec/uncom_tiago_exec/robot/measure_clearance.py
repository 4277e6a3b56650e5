# SPDX-License-Identifier: Apache-2.0
"""Measures the clearance maps of the robot (clearance_maps.py) and writes them to a file.

The file is made for a robot description by:
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
from uncom_tiago_exec.robot.clearance_maps import CLEARANCE_FILE, map_axes
from uncom_tiago_exec.robot.options import CLEARANCE_MAP, ClearanceMapOptions
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.types import SIDES


def measure_clearance_maps(group: ArmGroup, *, options: ClearanceMapOptions = CLEARANCE_MAP) -> list[dict[str, object]]:
    """Measure the maps of all pairs of a group's shapes that two joints lie between, as entries of the file."""
    geometry, model = group.geometry.copy(), group.model
    objects = list(geometry.geometryObjects)
    # of the links that the torso lifts only its own: head and other arm may have other angles when the map is used
    pairs = [
        (i, j)
        for i, j in group.body_pairs
        if abs(objects[i].parentJoint - objects[j].parentJoint) == options.joints_between
        and objects[i].name.startswith("torso_")
    ]
    entries: list[dict[str, object]] = []
    data, gdata = model.createData(), geometry.createData()
    for i, j in pairs:
        indices, lower, cells_per_rad = map_axes(model, geometry, i, j, options=options)
        outer = i if objects[i].parentJoint > objects[j].parentJoint else j
        displacement = _largest_displacement(group, outer, cells_per_rad, options=options)
        values = []
        q = np.array(pin.neutral(model))
        for row in range(options.cells):
            for column in range(options.cells):
                q[list(indices)] = [
                    lower[0] + (row + 0.5) / cells_per_rad[0],
                    lower[1] + (column + 0.5) / cells_per_rad[1],
                ]
                pin.updateGeometryPlacements(model, data, geometry, gdata, q)
                bound = _distance(objects, gdata, i, j) - displacement
                values.append(int(np.clip(bound / options.unit_m, 0.0, 255.0)))
        packed = base64.b64encode(zlib.compress(bytes(values), 9)).decode("ascii")
        entries.append({"shapes": [objects[i].name, objects[j].name], "millimetres": packed})
    return entries


def _distance(objects: list[Any], gdata: Any, i: int, j: int) -> float:
    """Return the distance of shapes i and j [m] at the placements in the geometry data."""
    placements = [coal.Transform3s(gdata.oMg[k].rotation, gdata.oMg[k].translation) for k in (i, j)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(objects[i].geometry, placements[0], objects[j].geometry, placements[1], request, result))


def _largest_displacement(
    group: ArmGroup, shape: int, cells_per_rad: tuple[float, float], *, options: ClearanceMapOptions = CLEARANCE_MAP
) -> float:
    """Return a bound [m] on the displacement of a corner of the outer shape within half a cell.

    It is the sum over both joints of the lever arm (greatest distance from the axis) times half a cell's angle.
    """
    model, outer = group.model, group.geometry.geometryObjects[shape]
    corners = np.array(outer.geometry.vertices()) @ outer.placement.rotation.T + outer.placement.translation
    second_lever = float(np.hypot(corners[:, 0], corners[:, 1]).max())
    joint_placement = model.jointPlacements[outer.parentJoint]
    first_lever = 0.0
    for angle in np.linspace(-np.pi, np.pi, options.lever_samples):
        rotation = pin.utils.rotate("z", float(angle))
        turned = corners @ rotation.T @ joint_placement.rotation.T + joint_placement.translation
        first_lever = max(first_lever, float(np.hypot(turned[:, 0], turned[:, 1]).max()))
    return 0.5 * (first_lever / cells_per_rad[0] + second_lever / cells_per_rad[1]) + options.slack_m


def main(argv: list[str], *, options: ClearanceMapOptions = CLEARANCE_MAP) -> int:
    """Write the file for the URDF file named on the command line; return the exit status."""
    if len(argv[1:]) != 1:
        sys.stderr.write("use: python -m uncom_tiago_exec.robot.measure_clearance URDF_FILE\n")
        return 2
    CLEARANCE_FILE.unlink(missing_ok=True)
    robot = RobotModel(Path(argv[1]).read_text(encoding="utf-8"))
    entries = [entry for side in SIDES for entry in measure_clearance_maps(robot.group(side, {}), options=options)]
    command = (
        f"python -m uncom_tiago_exec.robot.measure_clearance URDF_FILE  # {options.cells} by {options.cells} cells"
    )
    CLEARANCE_FILE.write_text(json.dumps({"command": command, "pairs": entries}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
