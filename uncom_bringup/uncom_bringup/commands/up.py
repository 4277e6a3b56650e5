# SPDX-License-Identifier: Apache-2.0
"""`uncom up`: start the graph and stay."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup.command_options import SubParsers, natural_number


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "up",
        help="start the graph and stay until Ctrl-C",
        description="Start all nodes and say what is heard, understood and done, until Ctrl-C.",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--sim", action="store_true", help="with the simulated TIAGo++ (no approval needed)")
    where.add_argument("--robot", action="store_true", help="on the robot's own topics (default)")
    parser.add_argument("--scenario", metavar="NAME", help="with --sim: what is on the table (default: iv)")
    parser.add_argument("--scene", metavar="FILE", help="with --sim: a scene file instead of a scenario")
    parser.add_argument("--seed", type=natural_number, default=0, help="with --sim: places, voice, hand, light")
    parser.add_argument("--start", action="store_true", help="with --sim: the person speaks as soon as all is up")
    approval = parser.add_mutually_exclusive_group()
    approval.add_argument("--approve", action="store_true", help="ask before every motion, in the simulator too")
    approval.add_argument("--no-approval", action="store_true", help="never ask before a motion")
    parser.add_argument("--params-file", action="append", default=[], metavar="YAML", help="parameters over ours")
    parser.add_argument("--log-dir", default="uncom_out/up", metavar="DIR", help="one log file a node")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Start and stay."""
    from uncom_bringup.ros import run_graph as up_node  # noqa: PLC0415  (only when it runs)

    return up_node.stay(
        sim=options.sim,
        scenario=options.scenario,
        scene=options.scene,
        seed=options.seed,
        start=options.start,
        require_approval=options.approve or not (options.sim or options.no_approval),
        parameter_files=[Path(name) for name in options.params_file],
        log_dir=Path(options.log_dir),
    )
