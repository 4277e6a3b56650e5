# SPDX-License-Identifier: Apache-2.0
"""Which pairs of links need no self-collision check, found by sampling and kept in a file.

The file is made anew for a robot description by:
    python -m uncom_tiago_exec.self_collision URDF_FILE
"""

from __future__ import annotations

import itertools
import json
import sys
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from uncom_tiago_exec.robot_model import RobotModel, link_of_geometry

Pair = frozenset[str]
FILE = Path(__file__).parent / "config" / "self_collision.json"
SAMPLES = 20_000


@lru_cache(maxsize=1)
def disabled_pairs() -> frozenset[Pair]:
    """Return the pairs of links that never, or always, touch; each as a set of two link names."""
    data = json.loads(FILE.read_text(encoding="utf-8"))
    return frozenset(frozenset(pair) for pair in (*data["never"], *data["always"]))


def adjacent_pairs(model: Any, geometry: Any) -> frozenset[Pair]:
    """Return pairs of links on the same joint or on joints that follow one another."""
    found = set()
    for a, b in itertools.combinations(geometry.geometryObjects, 2):
        i, j = a.parentJoint, b.parentJoint
        if i == j or model.parents[i] == j or model.parents[j] == i:
            found.add(frozenset((link_of_geometry(a.name), link_of_geometry(b.name))))
    return frozenset(found)


def sample_pairs(robot: RobotModel, samples: int = SAMPLES, seed: int = 0) -> dict[str, list[list[str]]]:
    """Check every pair of links at random configurations of arms, torso, head and fingers."""
    model, geometry = robot.model, robot.geometry.copy()
    skip = adjacent_pairs(model, geometry)
    objects = list(geometry.geometryObjects)
    geometry.removeAllCollisionPairs()
    links = []
    for i, j in itertools.combinations(range(len(objects)), 2):
        pair = frozenset((link_of_geometry(objects[i].name), link_of_geometry(objects[j].name)))
        if len(pair) == 2 and pair not in skip:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
            links.append(pair)
    data, gdata = model.createData(), geometry.createData()
    rng = np.random.default_rng(seed)
    low, high = np.array(model.lowerPositionLimit), np.array(model.upperPositionLimit)
    fixed = ~np.isfinite(low) | ~np.isfinite(high) | (high - low > 10.0)
    neutral = np.array(pin.neutral(model))
    counts = np.zeros(len(links), dtype=int)
    for _ in range(samples):
        q = np.where(fixed, neutral, rng.uniform(np.where(fixed, 0.0, low), np.where(fixed, 1.0, high)))
        pin.computeCollisions(model, data, geometry, gdata, q, False)
        counts += np.array([result.isCollision() for result in gdata.collisionResults])
    totals: dict[Pair, int] = {}
    for pair, count in zip(links, counts, strict=True):
        totals[pair] = max(totals.get(pair, 0), int(count))
    return {
        "never": sorted(sorted(pair) for pair, count in totals.items() if count == 0),
        "always": sorted(sorted(pair) for pair, count in totals.items() if count > 0.95 * samples),
    }


def main(argv: list[str]) -> int:
    """Write the file for a robot description given as a file."""
    if len(argv) != 2:
        sys.stderr.write("use: python -m uncom_tiago_exec.self_collision URDF_FILE\n")
        return 2
    pairs = sample_pairs(RobotModel(Path(argv[1]).read_text(encoding="utf-8")))
    command = f"python -m uncom_tiago_exec.self_collision URDF_FILE  # {SAMPLES} samples, seed 0"
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps({"command": command, **pairs}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
