# SPDX-License-Identifier: Apache-2.0
"""The behaviour tree that carried out a command, as rows of the report: what was tried, and why it failed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

KEY = "tree"  # of the last status's data


@dataclass(frozen=True, slots=True)
class Row:
    """One behaviour; depth is that of its branch."""

    depth: int
    name: str
    status: str
    reason: str


def rows_of(data: Mapping[str, Any]) -> list[Row]:
    """Return the behaviours of the tree in a status's data, from the root down; none if there is no tree in it."""
    tree = data.get(KEY)
    return list(_rows(tree, 0)) if isinstance(tree, dict) else []


def data_of(text: str) -> Mapping[str, Any]:
    """Read a status's data; empty where it is none."""
    try:
        data = json.loads(text) if text else {}
    except json.JSONDecodeError:
        return {}
    return data if isinstance(data, dict) else {}


def _rows(branch: Mapping[str, Any], depth: int) -> Iterator[Row]:
    status = str(branch.get("status", "")).lower()
    yield Row(depth, str(branch.get("name", "")), status, str(branch.get("reason", "")))
    for child in branch.get("children", ()):
        yield from _rows(child, depth + 1)
