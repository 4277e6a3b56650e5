# SPDX-License-Identifier: Apache-2.0
"""`uncom bench`: the benchmarks, each a module of its own in benchmarks/."""

from __future__ import annotations

import argparse
import importlib

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, natural_number

# One line each: the name on the command line and the module here that adds its parser (`add_parser(subparsers)`).
BENCHMARKS = {
    "understanding": "understanding",
    "latency": "latency",
    "planning": "planning",
    "execution": "execution",
}
PLANNED = ("planning", "execution", "latency")


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("bench", help="the benchmarks: how well the graph understands")
    parser.set_defaults(run=list_all)
    which = parser.add_subparsers(dest="which", metavar="BENCHMARK", parser_class=type(parser))
    for module in BENCHMARKS.values():
        importlib.import_module(f"uncom_bringup.commands.benchmarks.{module}").add_parser(which)
    for name in PLANNED:
        if name not in BENCHMARKS:
            later = which.add_parser(name, help="not part of this version")
            later.add_argument("--seed", type=natural_number, default=0, help=argparse.SUPPRESS)
            add_json(later)
            later.set_defaults(run=not_there)


def list_all(options: argparse.Namespace) -> int:
    """Name the benchmarks."""
    del options
    output.note(f"uncom bench: choose one of {', '.join(BENCHMARKS)} (uncom bench NAME --help tells more)")
    return 2


def not_there(options: argparse.Namespace) -> int:
    """Say that a benchmark is not part of this version."""
    output.note(f"uncom bench: the {options.which} benchmark is not part of this version")
    return 2
