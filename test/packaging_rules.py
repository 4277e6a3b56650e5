# SPDX-License-Identifier: Apache-2.0
"""What the packages import, what package.xml and setup.py declare, and what they should declare."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import yaml
from architecture import PACKAGES, ROOT, imports_of

# Python's own; the types of the standard library's stubs; and what every setup.py itself needs.
_OF_PYTHON = frozenset({*sys.stdlib_module_names, "_typeshed"})
_ALWAYS = "setuptools"
# Plugins and settings of the tests, which no test imports.
_TEST_PLUGINS = {"package_xml": {"python3-pytest-timeout"}, "pip": {"pytest-timeout"}}


@dataclass(frozen=True, slots=True)
class Declarations:
    """Dependencies of one package: names of ROS packages and rosdep keys, and names on PyPI."""

    package_xml: frozenset[str]
    test_depend: frozenset[str]
    install_requires: frozenset[str]
    extras_require: Mapping[str, frozenset[str]]


@cache
def table() -> dict[str, Any]:
    """Return dependencies.yaml."""
    return dict(yaml.safe_load((ROOT / "test" / "dependencies.yaml").read_text(encoding="utf-8")))


def pip_names(modules: Iterable[str]) -> frozenset[str]:
    """Return the names on PyPI of those modules that are on it."""
    known = table()["modules"]
    listed = (known[module]["pip"] for module in modules if module in known)
    return frozenset(name for names in listed for name in ([names] if isinstance(names, str) else names))


def package_names(modules: Iterable[str]) -> frozenset[str]:
    """Return the rosdep keys of modules, and the names of ROS packages, which are those of their modules."""
    known = table()["modules"]
    keys = (known[module].get("rosdep") if module in known else module for module in modules)
    return frozenset(key for key in keys if key is not None)


def imported_by_code(folder: Path) -> frozenset[str]:
    """Return the top-level modules from outside Python itself that the modules of a package import."""
    names = (name for path in folder.rglob("*.py") for name in imports_of(_parsed(path)))
    return frozenset(name.partition(".")[0] for name in names) - _OF_PYTHON


def imported_by_tests(folders: Iterable[Path]) -> frozenset[str]:
    """Return the same of tests and tools, which may import their neighbours."""
    files = [path for folder in folders for path in folder.rglob("*.py")]
    nodes = [
        node for path in files for node in ast.walk(_parsed(path)) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    names = {name.partition(".")[0] for node in nodes for name in imports_of(node)}
    return frozenset(names - _OF_PYTHON - {path.stem for path in files})


def _parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def needed(package: str) -> Declarations:
    """Return what a package has to declare, by its imports and those of its tests and tools."""
    folder = PACKAGES[package].parent
    extras = table()["extras"].get(package, {})
    beside = table()["without_import"].get(package, {})
    optional = {module for modules in extras.values() for module in modules}
    optional |= set(table()["undeclared"].get(package, ()))
    code = imported_by_code(PACKAGES[package]) - {package} - optional
    tests = imported_by_tests([folder / "test", folder / "tools"]) - {package} - optional - code
    return Declarations(
        package_names(code) | frozenset(beside.get("package_xml", ())),
        package_names(tests) | _TEST_PLUGINS["package_xml"],
        pip_names(code) | frozenset(beside.get("pip", ())) | {_ALWAYS},
        {
            **{name: pip_names(modules) for name, modules in extras.items()},
            "test": pip_names(tests) | _TEST_PLUGINS["pip"],
        },
    )


def declared(package: str) -> Declarations:
    """Return what a package declares."""
    folder = PACKAGES[package].parent
    root = ET.parse(folder / "package.xml").getroot()
    call = next(
        node
        for node in ast.walk(ast.parse((folder / "setup.py").read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "setup"
    )
    values = {item.arg: item.value for item in call.keywords}
    extras = ast.literal_eval(values["extras_require"])
    return Declarations(
        frozenset(item.text or "" for tag in ("depend", "exec_depend") for item in root.iter(tag)),
        frozenset(item.text or "" for item in root.iter("test_depend")),
        frozenset(ast.literal_eval(values["install_requires"])),
        {name: frozenset(names) for name, names in extras.items()},
    )
