# SPDX-License-Identifier: Apache-2.0
"""`uncom record`: what runs, into a bag."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup.command_options import SubParsers, positive_float


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "record",
        help="record what runs into a bag",
        description="Record until Ctrl-C (or --duration): sound, camera (JPEG and depth PNG), frames, joints, /uncom.",
    )
    parser.add_argument("bag", metavar="BAG", help="file to write (.mcap), or folder with --storage sqlite3")
    parser.add_argument("--storage", choices=("mcap", "sqlite3"), default="mcap")
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="these topics instead of the usual ones")
    parser.add_argument("--duration", type=positive_float, metavar="S", help="stop after this many seconds")
    parser.add_argument("--use-sim-time", action="store_true", help="stamp with /clock")
    parser.add_argument("--force", action="store_true", help="overwrite BAG")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Record."""
    from uncom_bringup.replay import recorder_node  # noqa: PLC0415  (only when it runs)

    return recorder_node.record(
        Path(options.bag),
        storage=options.storage,
        topics=tuple(options.topics or ()),
        duration_s=options.duration,
        use_sim_time=options.use_sim_time,
        force=options.force,
    )
