# SPDX-License-Identifier: Apache-2.0
"""What the source says of itself: every module of our packages with its imports."""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "uncom_common": ROOT / "uncom_common" / "uncom_common",
    "uncom_language": ROOT / "uncom_language" / "uncom_language",
    "uncom_perception": ROOT / "uncom_perception" / "uncom_perception",
    "uncom_reasoner": ROOT / "uncom_reasoner" / "uncom_reasoner",
    "uncom_tiago_exec": ROOT / "uncom_tiago_exec" / "uncom_tiago_exec",
    "uncom_bringup": ROOT / "uncom_bringup" / "uncom_bringup",
    "uncom_sim": ROOT / "sim" / "uncom_sim",
}

# Functions that import the module which their first argument names.
_LOADERS = ("import_module", "require")


@dataclass(frozen=True)
class Module:
    """One source file and the modules it imports, wherever in the file."""

    package: str
    path: Path
    imports: frozenset[str]
    defines_node: bool

    @property
    def name(self) -> str:
        return str(self.path.relative_to(ROOT))

    def imports_any(self, *roots: str) -> set[str]:
        return {name for name in self.imports if name.split(".")[0] in roots}


@functools.cache
def modules() -> tuple[Module, ...]:
    return tuple(_read_modules())


def _read_modules() -> Iterator[Module]:
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            yield Module(package, path, frozenset(imports_of(tree)), any(map(_is_node, ast.walk(tree))))


def _is_node(item: ast.AST) -> bool:
    """Tell whether something is a class that derives from rclpy's Node or from our base of nodes."""
    return isinstance(item, ast.ClassDef) and any(
        isinstance(name, ast.Name) and name.id in ("Node", "ConfiguredNode")
        for base in item.bases
        for name in ast.walk(base)
    )


def imports_of(tree: ast.AST) -> Iterator[str]:
    """Yield the names that a file imports, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in _LOADERS:
                yield str(node.args[0].value)


def import_graph(package: str) -> dict[str, set[str]]:
    """Return which modules of a package import which others of it, by dotted names; imports inside functions count."""
    found = {dotted(module): module for module in modules() if module.package == package}
    return {
        name: {target for target in map(found_name(found), module.imports) if target and target != name}
        for name, module in found.items()
    }


def found_name(known: Mapping[str, Module]) -> Callable[[str], str]:
    """Return what turns an imported name into that of the module it comes from, or "" if that is none of ours."""

    def module_of(imported: str) -> str:
        owner = imported.rpartition(".")[0]
        if imported in known:
            return imported
        return owner if owner in known and known[owner].path.name != "__init__.py" else ""

    return module_of


def dotted(module: Module) -> str:
    parts = module.path.relative_to(PACKAGES[module.package]).with_suffix("").parts
    return ".".join((module.package, *(part for part in parts if part != "__init__")))
