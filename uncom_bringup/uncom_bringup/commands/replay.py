# SPDX-License-Identifier: Apache-2.0
"""`uncom replay`: a bag into the live graph."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup.commands.common import SubParsers, positive_float
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "replay",
        help="publish a bag into the live graph",
        description="Publish what the senses of a bag recorded; compressed images are published as plain ones too. "
        "What our own nodes said (/uncom/...) and the truth (/sim/...) stay out unless asked for with --topics.",
    )
    parser.add_argument("bag", metavar="BAG", help="ROS 2 bag (.mcap, .db3 or folder) or ROS 1 bag (.bag)")
    parser.add_argument("--rate", type=positive_float, default=1.0, metavar="R", help="speed; 2 is twice as fast")
    parser.add_argument("--loop", action="store_true", help="again and again until Ctrl-C")
    parser.add_argument("--clock", action="store_true", help="publish the bag's time on /clock")
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Replay."""
    path = Path(options.bag)
    if not path.exists():
        raise BadInputError(f"{path} does not exist")
    from uncom_bringup import player_node  # noqa: PLC0415  (only when it runs)

    return player_node.replay(
        path, rate=options.rate, loop=options.loop, clock=options.clock, topics=tuple(options.topics or ())
    )
