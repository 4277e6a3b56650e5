# SPDX-License-Identifier: Apache-2.0
"""Finds by sampling which pairs of links never, or always, touch, and writes them to a file.

The file is made for a robot description by:
    python -m uncom_tiago_exec.robot.measure_self_collision URDF_FILE
"""

from __future__ import annotations

import itertools
import json
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

from uncom_tiago_exec.robot.link_pairs import SELF_COLLISION_FILE, Pair, adjacent_pairs, link_of_geometry
from uncom_tiago_exec.robot.options import SELF_COLLISION_SAMPLES, SelfCollisionSampleOptions
from uncom_tiago_exec.robot.robot_model import RobotModel


def sample_pairs(
    robot: RobotModel, seed: int = 0, *, options: SelfCollisionSampleOptions = SELF_COLLISION_SAMPLES
) -> dict[str, list[list[str]]]:
    """Check every pair of links at random configurations of arms, torso, head and fingers.

    Args:
        robot: model of the whole robot.
        seed: of the random configurations.
        options: numbers that tune it.

    Returns:
        Pairs of link names: "never" those that touch at no configuration, "always" those that touch at nearly all.
    """
    model, geometry = robot.model, robot.geometry.copy()
    skip = adjacent_pairs(model, geometry)
    objects = list(geometry.geometryObjects)
    geometry.removeAllCollisionPairs()
    links = []
    for i, j in itertools.combinations(range(len(objects)), 2):
        pair = frozenset((link_of_geometry(objects[i].name), link_of_geometry(objects[j].name)))
        if len(pair) > 1 and pair not in skip:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
            links.append(pair)
    data, gdata = model.createData(), geometry.createData()
    rng = np.random.default_rng(seed)
    low, high = np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit)
    fixed = ~np.isfinite(low) | ~np.isfinite(high) | (high - low > options.widest_range)
    neutral = np.array(pin.neutral(model))
    counts = np.zeros(len(links), dtype=int)
    for _ in range(options.samples):
        q = np.where(fixed, neutral, rng.uniform(np.where(fixed, 0.0, low), np.where(fixed, 1.0, high)))
        pin.computeCollisions(model, data, geometry, gdata, q, False)
        counts += np.array([result.isCollision() for result in gdata.collisionResults])
    totals: dict[Pair, int] = {}
    for pair, count in zip(links, counts, strict=True):
        totals[pair] = max(totals.get(pair, 0), int(count))
    often = options.always_share * options.samples
    return {
        "never": sorted(sorted(pair) for pair, count in totals.items() if count == 0),
        "always": sorted(sorted(pair) for pair, count in totals.items() if count > often),
    }


def main(argv: list[str]) -> int:
    """Write the file for the URDF file named on the command line; return the exit status."""
    if len(argv[1:]) != 1:
        sys.stderr.write("use: python -m uncom_tiago_exec.robot.measure_self_collision URDF_FILE\n")
        return 2
    pairs = sample_pairs(RobotModel(Path(argv[1]).read_text(encoding="utf-8")))
    samples = SELF_COLLISION_SAMPLES.samples
    command = f"python -m uncom_tiago_exec.robot.measure_self_collision URDF_FILE  # {samples} samples, seed 0"
    SELF_COLLISION_FILE.parent.mkdir(exist_ok=True)
    SELF_COLLISION_FILE.write_text(json.dumps({"command": command, **pairs}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
