# SPDX-License-Identifier: Apache-2.0
"""Read the 22 scenarios (scenarios.yaml)."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from importlib import resources
from typing import Any

import yaml

from uncom_sim.bench_understanding.takes.types import Cast, Rivals, Scenario
from uncom_sim.exceptions import SceneError


@functools.cache
def scenarios() -> tuple[Scenario, ...]:
    """Return all scenarios in order."""
    text = (resources.files("uncom_sim") / "bench_understanding" / "takes" / "scenarios.yaml").read_text(
        encoding="utf-8"
    )
    data = yaml.safe_load(text)
    return tuple(_scenario(entry, data["frames"]) for entry in data["scenarios"])


def scenario(number: int) -> Scenario:
    """Return the scenario of a number.

    Raises:
        SceneError: there is none.
    """
    for one in scenarios():
        if one.id == number:
            return one
    raise SceneError(f"there is no scenario {number}; scenarios are 1 to {len(scenarios())}")


def _scenario(entry: dict[str, Any], frames: dict[str, list[str]]) -> Scenario:
    clutter = entry.get("clutter")
    return Scenario(
        id=int(entry["id"]),
        name=str(entry["name"]),
        takes=int(entry["takes"]),
        row=entry.get("row"),
        object=str(entry["object"]),
        target=str(entry["target"]),
        frames=tuple(frames[entry["frame"]]),
        relations=_relations(entry),
        object_phrases=tuple(entry["o"]),
        target_phrases=tuple(entry["t"]),
        casts=tuple(_cast(cast) for cast in entry["cast"]),
        point=tuple(entry["point"]),
        action={"here": "put"}.get(entry["frame"], entry["frame"]),
        rivals=_rivals(entry.get("rivals")),
        target_rivals=_rivals(entry.get("target_rivals")),
        clutter=None if clutter is None else (int(clutter[0]), int(clutter[1])),
    )


def _relations(entry: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    words = entry.get("r", [""])
    if isinstance(words, dict):
        return {name: tuple(words[name]) for name in entry["relation"]}
    return {str(entry["relation"]): tuple(words)}


def _cast(entry: Sequence[Any]) -> Cast:
    pairs = [(part[0], part[1]) if isinstance(part, list) else (part, part) for part in entry]
    return Cast(*(str(text) for pair in pairs for text in pair))


def _rivals(entry: dict[str, Any] | None) -> Rivals | None:
    return None if entry is None else Rivals(str(entry["kind"]), int(entry["count"][0]), int(entry["count"][1]))
