# SPDX-License-Identifier: Apache-2.0
"""Numbers that tune, declared as fields of frozen option classes: each with its meaning, unit and source.

A room that has such numbers keeps its option classes in a module called `options`. Functions take them as a keyword
argument whose default is the shipped instance, classes in their constructor, so that a test, a benchmark or a node can
give others:

    @dataclass(frozen=True, slots=True)
    class GraspSamplerOptions:
        "How grasps are sampled."

        clearance_m: float = tunable(0.005, unit="m", meaning="least gap between an open finger and the object")

    GRASP_SAMPLER = GraspSamplerOptions()

`uncom tunables` prints them all.
"""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

ValueT = TypeVar("ValueT")
_META = "tunable"


@dataclass(frozen=True, slots=True)
class Tunable:
    """One number, or tuple of numbers, that tunes.

    group: dotted name of the option class; unit: SI or px, and empty for a ratio or a count; source: a paper section,
    a datasheet, a standard or the command that measured it, and empty where it was chosen by hand.
    """

    group: str
    name: str
    value: Any
    unit: str
    meaning: str
    source: str


def tunable(default: ValueT, *, unit: str = "", meaning: str, source: str = "") -> ValueT:
    """Declare a field of a frozen option class with its meaning, unit and source."""
    # To a type checker the field is its default value, as with dataclasses.field.
    return dataclasses.field(default=default, metadata={_META: {"unit": unit, "meaning": meaning, "source": source}})


def tunables_of(options: type[Any]) -> tuple[Tunable, ...]:
    """Return the tunables that an option class declares, with their default values."""
    group = f"{options.__module__}.{options.__qualname__}"
    return tuple(
        Tunable(group, item.name, item.default, **item.metadata[_META])
        for item in dataclasses.fields(options)
        if _META in item.metadata
    )


def find_tunables(package: str) -> Iterator[Tunable]:
    """Yield the tunables of all modules called `options` in an installed package.

    Raises:
        ModuleNotFoundError: there is no such package.
    """
    root = importlib.import_module(package)
    for module in pkgutil.walk_packages(root.__path__, f"{package}."):
        if module.name.rpartition(".")[2] == "options":
            for item in vars(importlib.import_module(module.name)).values():
                if isinstance(item, type) and dataclasses.is_dataclass(item) and item.__module__ == module.name:
                    yield from tunables_of(item)
