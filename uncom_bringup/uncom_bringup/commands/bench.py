# SPDX-License-Identifier: Apache-2.0
"""`uncom bench`: which benchmarks there are."""

from __future__ import annotations

import argparse

from uncom_bringup import output
from uncom_bringup.commands.common import SubParsers, add_json, natural_number

BENCHMARKS = ("understanding", "planning", "execution", "latency")


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("bench", help="the benchmarks (none is part of this version)")
    parser.add_argument("which", nargs="?", choices=BENCHMARKS, help="which one; without it, list them")
    parser.add_argument("--seed", type=natural_number, default=0, help="everything random comes from it")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Say that this version has no benchmark."""
    if options.which is None:
        output.note(f"uncom bench: {', '.join(BENCHMARKS)} are planned; none is part of this version")
    else:
        output.note(
            f"uncom bench: the {options.which} benchmark is not part of this version; `uncom demo` runs one scene"
        )
    return 2
