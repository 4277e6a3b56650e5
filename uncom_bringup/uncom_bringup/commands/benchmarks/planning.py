# SPDX-License-Identifier: Apache-2.0
"""`uncom bench planning`: inverse kinematics, state checks, single plans and whole pick-and-place plans, timed."""

from __future__ import annotations

import argparse

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, natural_number, simulator_needed
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the benchmark."""
    parser = subparsers.add_parser(
        "planning",
        help="how fast and how surely motions are planned (1000 poses, 60 plans, 60 whole pick-and-places)",
        description="Time inverse kinematics, collision checks and plans; processor time of one thread.",
    )
    parser.add_argument("--seed", type=natural_number, default=0, help="everything random comes from it (default: 0)")
    parser.add_argument(
        "--poses", type=natural_number, default=1000, metavar="N", help="poses to solve (default: 1000)"
    )
    parser.add_argument(
        "--plans", type=natural_number, default=60, metavar="N", help="plans of each kind (default: 60)"
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the benchmark."""
    with simulator_needed():
        from uncom_sim.bench_planning import report  # noqa: PLC0415  (only when it runs)
        from uncom_sim.bench_planning import run as bench_planning  # noqa: PLC0415
    if options.poses < 1 or options.plans < 1:
        raise BadInputError("--poses and --plans must be at least 1")
    result = bench_planning.run_benchmark(options.seed, options.poses, options.plans, output.note)
    if options.json:
        output.emit_json(result)
    else:
        output.emit(report.table(result))
    return 0
