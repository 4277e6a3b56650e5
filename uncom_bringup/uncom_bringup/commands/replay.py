# SPDX-License-Identifier: Apache-2.0
"""`uncom replay`: a bag into the live graph."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from uncom_bringup.command_options import SubParsers, natural_float, positive_float
from uncom_bringup.exceptions import BadInputError

_NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "replay",
        help="publish a bag into the live graph",
        description="Publish what the senses of a bag recorded; compressed images are published as plain ones too. "
        "What our own nodes said (/uncom/...) and the truth (/sim/...) stay out unless asked for with --topics. "
        "In a terminal: space pauses, s or the right arrow sends one message, up and down change the rate, q stops.",
    )
    parser.add_argument("bag", metavar="BAG", help="ROS 2 bag (.mcap, .db3 or folder) or ROS 1 bag (.bag)")
    parser.add_argument("--rate", type=positive_float, default=1.0, metavar="R", help="speed; 2 is twice as fast")
    parser.add_argument("--loop", action="store_true", help="again and again until Ctrl-C")
    parser.add_argument("--start", type=natural_float, default=0.0, metavar="S", help="begin so far into the bag [s]")
    parser.add_argument("--duration", type=positive_float, metavar="S", help="end so long after the beginning [s]")
    parser.add_argument("--topics", nargs="+", metavar="TOPIC", help="only these")
    parser.add_argument("--remap", nargs="+", default=[], metavar="A:=B", help="publish topic A under the name B")
    parser.add_argument("--clock", action="store_true", help="publish the bag's time on /clock")
    parser.set_defaults(run=run)


def remappings(texts: list[str]) -> dict[str, str]:
    """Read a:=b.

    Raises:
        BadInputError: something is not of this form, or no topic name.
    """
    found = {}
    for text in texts:
        old, sign, new = text.partition(":=")
        if not sign or not _NAME.fullmatch(old) or not _NAME.fullmatch(new):
            raise BadInputError(f"--remap {text!r} is not of the form /old/name:=/new/name")
        found["/" + old.lstrip("/")] = "/" + new.lstrip("/")
    return found


def run(options: argparse.Namespace) -> int:
    """Replay."""
    path = Path(options.bag)
    if not path.exists():
        raise BadInputError(f"{path} does not exist")
    remap = remappings(options.remap)
    from uncom_bringup.ros import replay_session as replay_node  # noqa: PLC0415  (only when it runs)

    return replay_node.replay(
        path,
        replay_node.ReplayOptions(
            rate=options.rate,
            loop=options.loop,
            start_s=options.start,
            duration_s=options.duration,
            topics=tuple(options.topics or ()),
            remap=remap,
            clock=options.clock,
        ),
    )
