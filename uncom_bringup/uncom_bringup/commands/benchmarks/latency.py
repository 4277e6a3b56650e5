# SPDX-License-Identifier: Apache-2.0
"""`uncom bench latency`: how long after the last word the grounded command is there, at the pace of the clock."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from uncom_bringup import output
from uncom_bringup.command_options import (
    SubParsers,
    add_json,
    add_output,
    add_parameters,
    natural_number,
    output_folder,
    simulator_needed,
)


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the benchmark."""
    parser = subparsers.add_parser(
        "latency",
        help="how long after the last word the grounded command is there",
        description="Play bags at the pace of the clock into the nodes, and measure every stage on the wall's clock.",
    )
    parser.add_argument("bags", nargs="*", metavar="BAG", help="bags to play; without, takes are made by the simulator")
    parser.add_argument("--seed", type=natural_number, default=0, help="of the takes that are made (default: 0)")
    parser.add_argument("--takes", type=natural_number, default=8, metavar="N", help="how many are made (default: 8)")
    add_output(parser, "the nodes' logs")
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run the benchmark."""
    from uncom_bringup.ros import measure_latency as latency_node  # noqa: PLC0415  (only when it runs)

    folder = output_folder(options.out, "bench-latency", options.force)
    parameters = [Path(name) for name in options.params_file]
    with tempfile.TemporaryDirectory(prefix="uncom_latency_") as made:
        bags = [Path(name) for name in options.bags] or _made(Path(made), options.seed, options.takes)
        report = latency_node.measure(bags, folder, parameters, output.note)
    if options.json:
        output.emit_json(report)
    else:
        output.emit(report_text(report))
    return 0 if report["commands"] else 1


def report_text(report: Mapping[str, Any]) -> str:
    """Write the figures as a table."""
    lines = [f"{'after the last word [s]':<26}{'median':>8}{'95 %':>8}{'worst':>8}"]
    lines += [
        f"{stage:<26}{of['median']:>8.2f}{of['p95']:>8.2f}{of['worst']:>8.2f}"
        for stage, of in report["stages_s"].items()
    ]
    memory = report["memory_mb"]
    lines.append(f"{report['commands']} commands; nodes' memory {memory['before']:.0f} -> {memory['after']:.0f} MB")
    return "\n".join(lines)


def _made(folder: Path, seed: int, count: int) -> list[Path]:
    """Make takes of the benchmark's scenarios as bags."""
    with simulator_needed("name bags to play"):
        from uncom_sim.bench_understanding.ros.take_bag import write_bag  # noqa: PLC0415
        from uncom_sim.bench_understanding.takes.take_planning import plan_takes  # noqa: PLC0415
        from uncom_sim.bench_understanding.takes.take_synthesis import make_take  # noqa: PLC0415
    return [write_bag(make_take(plan), folder / f"{plan.name}.mcap") for plan in plan_takes(seed, (), count)]
