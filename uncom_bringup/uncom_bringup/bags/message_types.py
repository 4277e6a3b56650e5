# SPDX-License-Identifier: Apache-2.0
"""Definitions of installed message types for bags, so that a bag can be read where our packages are not installed."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from uncom_bringup.exceptions import UnknownTypeError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


def definition_file(type_name: str) -> Path:
    """Find the `.msg` file of `package/msg/Name` in the prefixes of AMENT_PREFIX_PATH.

    Raises:
        UnknownTypeError: no prefix has it.
    """
    package, kind, name = type_name.split("/")
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        path = Path(prefix) / "share" / package / kind / f"{name}.msg"
        if prefix and path.is_file():
            return path
    raise UnknownTypeError(type_name)


@lru_cache(maxsize=1)
def installed_store() -> Typestore:
    """Return the store of known types: Jazzy's own, and what `register` has added."""
    return get_typestore(Stores.ROS2_JAZZY)


def register(type_name: str) -> Typestore:
    """Make a type and all it is made of known to the store, and return the store.

    Raises:
        UnknownTypeError: a definition is not installed.
    """
    store = installed_store()
    todo = [type_name]
    found = {}
    while todo:
        name = todo.pop()
        if name in store.fielddefs or name in found:
            continue
        text = definition_file(name).read_text(encoding="utf-8")
        types = get_types_from_msg(text, name)
        found.update(types)
        todo += [part for _, fields in types.values() for part in _parts(fields)]
    if found:
        store.register(found)
    return store


def _parts(fields: object) -> list[str]:
    """List the message types that fields refer to: nested descriptions of (node kind, (name, ...) or nested)."""
    names: list[str] = []

    def walk(item: object) -> None:
        if isinstance(item, str):
            if "/msg/" in item:
                names.append(item)
        elif isinstance(item, (tuple, list)):
            for part in item:
                walk(part)

    walk(fields)
    return names
