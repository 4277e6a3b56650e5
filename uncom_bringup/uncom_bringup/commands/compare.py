# SPDX-License-Identifier: Apache-2.0
"""`uncom compare`: what changed between two runs."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, positive_float


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "compare",
        help="what changed between two runs: words, candidates, probabilities, choice",
        description="Compare what two runs understood. Exit status 0: the same, 1: something changed.",
    )
    for name in ("RUN_A", "RUN_B"):
        parser.add_argument(name.lower(), metavar=name, help="folder that understand or demo left, or its command.json")
    parser.add_argument(
        "--tolerance", type=positive_float, default=0.001, metavar="P", help="probabilities this near are the same"
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Compare; 1 if anything changed."""
    from uncom_bringup.report import compare  # noqa: PLC0415  (only when it runs)

    before, after = (compare.load_answer(Path(name)) for name in (options.run_a, options.run_b))
    found = compare.compare(before, after, compare.Tolerance(probability=options.tolerance))
    if options.json:
        output.emit_json({"same": not found, "differences": [difference.to_json() for difference in found]})
    else:
        for difference in found:
            output.emit(difference.in_words())
        output.emit(f"{len(found)} differences" if found else "the same")
    return 1 if found else 0
