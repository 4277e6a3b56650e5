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
import importlib.util
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
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
    """Yield the tunables of all modules called `options` in an installed package, in order of their names.

    Only those modules are loaded, not the packages around them, whose imports take seconds.

    Raises:
        ModuleNotFoundError: there is no such package.
    """
    spec = importlib.util.find_spec(package)
    if spec is None or spec.submodule_search_locations is None:
        raise ModuleNotFoundError(f"no package named {package!r}", name=package)
    for folder in spec.submodule_search_locations:
        root = Path(folder)
        for path in sorted(root.rglob("options.py")):
            module = _load_module(".".join((package, *path.relative_to(root).with_suffix("").parts)), path)
            for item in vars(module).values():
                if isinstance(item, type) and dataclasses.is_dataclass(item) and item.__module__ == module.__name__:
                    yield from tunables_of(item)


def _load_module(name: str, path: Path) -> ModuleType:
    """Return a module of this dotted name, executed from its file unless it is imported already."""
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ModuleNotFoundError(f"{path} is not a module", name=name)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up while they are made
    try:
        spec.loader.exec_module(module)
    finally:
        del sys.modules[name]
    return module
