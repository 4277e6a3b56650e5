# SPDX-License-Identifier: Apache-2.0
"""Figures of the structure of our packages: `./uncom exec python test/measure_structure.py [PACKAGE ...]`.

Library code only (no tests). A numeric constant is a module-level name bound to a number, or to a tuple or a list of
numbers, or to an expression of such; fields of classes and default arguments are none. Names the offenders with -v.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

from architecture import PACKAGES, Module, import_graph, modules

MAX_MODULES_IN_FOLDER = 15
MAX_CONSTANTS_PER_1000_LINES = 2.0
MAX_LONG_FUNCTIONS = 5
FUNCTION_LINES = 50
FILE_LINES = 300


@dataclass
class Figures:
    """What was counted in one package, each with the places that were counted."""

    lines: int = 0
    files: int = 0
    folders: Counter[str] = field(default_factory=Counter)
    constants: list[str] = field(default_factory=list)
    long_functions: list[str] = field(default_factory=list)
    long_files: list[str] = field(default_factory=list)
    functions: int = 0
    public: int = 0
    undocumented: list[str] = field(default_factory=list)

    @property
    def constants_per_1000(self) -> float:
        return 1000.0 * len(self.constants) / max(self.lines, 1)


def measure(package: str) -> Figures:
    """Count everything in a package."""
    found = Figures()
    for module in modules():
        if module.package == package:
            _count(module, found)
    return found


def _count(module: Module, found: Figures) -> None:
    text = module.path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    lines = len(text.splitlines())
    found.lines += lines
    found.files += 1
    if module.path.name != "__init__.py":
        found.folders[str(module.path.parent.relative_to(PACKAGES[module.package]))] += 1
    if lines > FILE_LINES:
        found.long_files.append(f"{module.name}: {lines}")
    found.constants += [f"{module.name}: {name}" for name in numeric_constants(tree)]
    for owner, item in _definitions(tree):
        _count_definition(module, owner, item, found)


def _count_definition(module: Module, owner: str, item: ast.AST, found: Figures) -> None:
    name = f"{owner}{item.name}"
    if isinstance(item, ast.FunctionDef | ast.AsyncFunctionDef):
        found.functions += 1
        length = (item.end_lineno or item.lineno) - item.lineno + 1
        if length > FUNCTION_LINES:
            found.long_functions.append(f"{module.name}: {name}: {length}")
    if not any(part.startswith("_") for part in name.split(".")):
        found.public += 1
        if not ast.get_docstring(item):
            found.undocumented.append(f"{module.name}: {name}")


def _definitions(tree: ast.AST, owner: str = "") -> Iterator[tuple[str, ast.AST]]:
    for item in ast.iter_child_nodes(tree):
        if isinstance(item, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield owner, item
            if isinstance(item, ast.ClassDef):
                yield from _definitions(item, f"{owner}{item.name}.")
        elif isinstance(item, ast.If | ast.Try):
            yield from _definitions(item, owner)


def numeric_constants(tree: ast.Module) -> Iterator[str]:
    """Yield the names that a module binds to numbers."""
    for item in tree.body:
        if isinstance(item, ast.Assign):
            targets, value = item.targets, item.value
        elif isinstance(item, ast.AnnAssign) and item.value is not None:
            targets, value = [item.target], item.value
        else:
            continue
        if _is_numeric(value):
            yield from (ast.unparse(target) for target in targets)


def _is_numeric(value: ast.expr) -> bool:
    """Tell whether an expression is made of numbers alone (and at least one)."""
    match value:
        case ast.Constant(value=bool()):
            found = False
        case ast.Constant(value=number):
            found = isinstance(number, int | float)
        case ast.UnaryOp(operand=operand):
            found = _is_numeric(operand)
        case ast.BinOp(left=left, right=right):
            found = _is_numeric(left) or _is_numeric(right)
        case ast.Tuple(elts=parts) | ast.List(elts=parts) | ast.Set(elts=parts) | ast.Dict(values=parts):
            found = any(map(_is_numeric, parts))
        case ast.Call(func=function, args=parts):
            found = ast.unparse(function).split(".")[0] in ("np", "math", "tuple") and any(map(_is_numeric, parts))
        case _:
            found = False
    return found


def circles(package: str) -> list[list[str]]:
    """Return the circles of imports among the modules of a package (strongly connected components of two or more)."""
    graph = import_graph(package)
    return [sorted(part) for part in _components(graph) if len(part) > 1]


def _components(graph: dict[str, set[str]]) -> Iterator[set[str]]:
    """Tarjan's strongly connected components."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in graph.get(name, ()):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            part: set[str] = set()
            while name not in part:
                part.add(stack.pop())
            found.append(part)

    for name in graph:
        if name not in index:
            visit(name)
    return iter(found)


def main() -> int:
    """Print the figures of the packages, and with -v every place that was counted."""
    parser = argparse.ArgumentParser(description="figures of the structure of our packages")
    parser.add_argument("packages", nargs="*", choices=[*PACKAGES, []], default=[])
    parser.add_argument("-v", "--verbose", action="store_true", help="name every place")
    options = parser.parse_args()
    head = ("package", "files", "lines", "biggest folder", "circles", "numbers/1000", f"functions > {FUNCTION_LINES}")
    rows = [(*head, f"files > {FILE_LINES}", "public documented")]
    places: dict[str, list[str]] = defaultdict(list)
    for package in options.packages or PACKAGES:
        found, rings = measure(package), circles(package)
        folder, count = found.folders.most_common(1)[0]
        rows.append(
            (
                package,
                str(found.files),
                str(found.lines),
                f"{count} ({folder})",
                str(len(rings)),
                f"{found.constants_per_1000:.1f}",
                f"{len(found.long_functions)} of {found.functions}",
                str(len(found.long_files)),
                f"{found.public - len(found.undocumented)} of {found.public}",
            )
        )
        places[package] = [*map(" <-> ".join, rings), *found.constants, *found.long_functions, *found.long_files]
        places[package] += [f"{place} (no docstring)" for place in found.undocumented]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        sys.stdout.write("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() + "\n")
    if options.verbose:
        for package, names in places.items():
            sys.stdout.write(f"\n{package}\n" + "".join(f"  {name}\n" for name in names))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
