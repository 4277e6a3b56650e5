# SPDX-License-Identifier: Apache-2.0
"""`uncom bench execution`: single commands over all kinds, relations and both arms, carried out by physics."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, add_workers, natural_number, simulator_needed
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the benchmark."""
    parser = subparsers.add_parser(
        "execution",
        help="how often single commands end as they should (60 commands, physics faster than real time)",
        description="Ground commands by the detector on rendered pictures, carry them out by physics, judge.",
    )
    parser.add_argument("--seed", type=natural_number, default=0, help="everything random comes from it (default: 0)")
    parser.add_argument("--runs", type=natural_number, default=60, metavar="N", help="how many commands (default: 60)")
    add_workers(parser)
    parser.add_argument("--shots", metavar="DIR", help="leave pictures from outside here, one after each motion")
    parser.add_argument(
        "--in-a-row", type=natural_number, default=0, metavar="N", help="N commands to one robot, one after the other"
    )
    parser.add_argument(
        "--stops",
        type=natural_number,
        default=0,
        metavar="N",
        help="stop one robot at N random moments of its commands",
    )
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the benchmark; 0 if nothing failed, 1 if something did."""
    with simulator_needed():
        from uncom_sim.bench_execution import consecutive_commands, stop_trials  # noqa: PLC0415  (only when it runs)
        from uncom_sim.bench_execution import run as bench_execution  # noqa: PLC0415
        from uncom_sim.cluster.task_pool import PoolOptions  # noqa: PLC0415
    if options.runs < 1:
        raise BadInputError("--runs must be at least 1")
    if options.in_a_row:
        turns = consecutive_commands.run_consecutive_commands(options.in_a_row, options.seed, output.note)
        if options.json:
            output.emit_json(turns)
        else:
            output.emit(consecutive_commands.table(turns))
        return 0 if turns["succeeded"] == options.in_a_row else 1
    if options.stops:
        stopped = stop_trials.run_stops(options.stops, options.seed, output.note)
        if options.json:
            output.emit_json(stopped)
        else:
            output.emit(stop_trials.table(stopped))
        return 0 if stopped["usable"] == stopped["still"] == options.stops else 1
    shots = Path(options.shots) if options.shots else None
    if shots is not None:
        shots.mkdir(parents=True, exist_ok=True)
    pool = PoolOptions(options.jobs, options.scheduler)
    result = bench_execution.run_benchmark(range(options.runs), options.seed, pool, output.note, shots)
    if options.json:
        output.emit_json(result)
    else:
        output.emit(bench_execution.table(result))
    return 0 if result["succeeded"] == result["runs"] else 1
