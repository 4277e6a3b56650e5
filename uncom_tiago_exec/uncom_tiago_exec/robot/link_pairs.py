# SPDX-License-Identifier: Apache-2.0
"""Pairs of links that need no self-collision check: neighbours in the chain, and those that a file lists.

The file is made by measure_self_collision.py.
"""

from __future__ import annotations

import itertools
import json
import re
from functools import lru_cache
from pathlib import Path
from typing import Any

Pair = frozenset[str]
SELF_COLLISION_FILE = Path(__file__).parents[1] / "config" / "self_collision.json"


def link_of_geometry(name: str) -> str:
    """Return the name of the link that a collision shape belongs to; pinocchio names shapes LINK_0, LINK_1, ..."""
    return re.sub(r"_\d+$", "", name)


@lru_cache(maxsize=1)
def disabled_pairs() -> frozenset[Pair]:
    """Return the pairs of links that never, or always, touch according to the file; each a set of two link names."""
    data = json.loads(SELF_COLLISION_FILE.read_text(encoding="utf-8"))
    return frozenset(frozenset(pair) for pair in (*data["never"], *data["always"]))


def adjacent_pairs(model: Any, geometry: Any) -> frozenset[Pair]:
    """Return the pairs of links that are on one joint or on two successive joints."""
    found = set()
    for a, b in itertools.combinations(geometry.geometryObjects, 2):
        i, j = a.parentJoint, b.parentJoint
        if i == j or model.parents[i] == j or model.parents[j] == i:
            found.add(frozenset((link_of_geometry(a.name), link_of_geometry(b.name))))
    return frozenset(found)
