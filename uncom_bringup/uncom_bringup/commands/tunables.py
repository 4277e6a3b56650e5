# SPDX-License-Identifier: Apache-2.0
"""`uncom tunables`: every number that tunes, with its unit, meaning and source."""

from __future__ import annotations

import argparse
import dataclasses
import difflib
import importlib.util
from collections.abc import Sequence
from itertools import groupby

from uncom_common.tunables import Tunable, find_tunables

from uncom_bringup import output
from uncom_bringup.command_options import ROBOT_PACKAGES, SIMULATOR_PACKAGE, SubParsers, add_json
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "tunables",
        help="every number that tunes, with its value, unit, meaning and source",
        description="Print the fields of the option classes, grouped by class.",
    )
    parser.add_argument(
        "group",
        nargs="?",
        default="",
        metavar="PACKAGE|GROUP",
        help="only this package, folder or option class, e.g. uncom_language.speech or WhisperOptions (default: all)",
    )
    add_json(parser)
    parser.set_defaults(run=run)


def installed_packages() -> tuple[str, ...]:
    """Return the names of our packages that can be imported here."""
    return tuple(name for name in (*ROBOT_PACKAGES, SIMULATOR_PACKAGE) if importlib.util.find_spec(name) is not None)


def select_tunables(wanted: str) -> list[Tunable]:
    """Return the tunables of a package, of a folder in one, or of an option class by its dotted name or name alone.

    Raises:
        BadInputError: nothing is called so.
    """
    found = [item for package in installed_packages() for item in find_tunables(package)]
    chosen = [
        item
        for item in found
        if not wanted or f"{item.group}.".startswith(f"{wanted}.") or item.group.rpartition(".")[2] == wanted
    ]
    if wanted and not chosen and wanted not in installed_packages():
        groups = {item.group.rpartition(".")[2] for item in found}
        near = difflib.get_close_matches(wanted, groups, cutoff=0.4)
        raise BadInputError(
            f"nothing that tunes is called {wanted!r}; packages are {', '.join(installed_packages())}"
            + (f"; option classes like that are {', '.join(near)}" if near else "")
        )
    return chosen


def table_lines(tunables: Sequence[Tunable]) -> list[str]:
    """Return a heading for each option class and a line for each of its fields."""
    lines: list[str] = []
    for group, items in groupby(tunables, key=lambda item: item.group):
        lines += ["", group] if lines else [group]
        for item in items:
            value = f"{item.value} {item.unit}".strip()
            source = f" [{item.source}]" if item.source else ""
            lines.append(f"  {item.name:<32} {value:<20} {item.meaning}{source}")
    return lines


def run(options: argparse.Namespace) -> int:
    """Print them."""
    tunables = select_tunables(options.group)
    if options.json:
        output.emit_json({"tunables": [dataclasses.asdict(item) for item in tunables]})
    else:
        for line in table_lines(tunables):
            output.emit(line)
    return 0
