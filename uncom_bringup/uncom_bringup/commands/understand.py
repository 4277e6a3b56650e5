# SPDX-License-Identifier: Apache-2.0
"""`uncom understand`: a recorded bag to grounded commands, picture and report."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from uncom_bringup import output
from uncom_bringup.command_options import (
    SubParsers,
    add_json,
    add_output,
    add_parameters,
    output_folder,
    positive_float,
)
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.report import progress

_VIDEO = (".mp4", ".mkv", ".mov", ".avi", ".webm")


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "understand",
        help="recorded bag or video -> grounded command, annotated picture, report",
        description="Play a bag to all nodes but the one that moves, and tell what was understood. Time goes on as "
        "fast as the nodes answer: nothing is dropped, and the answer is the same on every machine.",
    )
    parser.add_argument(
        "file", metavar="FILE", help="bag with /audio and the head camera's images, or a video (.mp4, .mov, ...)"
    )
    parser.add_argument("--rate", type=positive_float, metavar="R", help="at most R times as fast as it was recorded")
    add_output(parser, "the report")
    add_parameters(parser)
    add_json(parser)
    parser.set_defaults(run=run)


def _as_bag(path: Path, stack: ExitStack, say: Callable[[str], None]) -> Path:
    """Return the bag itself, or the bag made of a video (which `stack` removes)."""
    if path.suffix.lower() not in _VIDEO:
        return path
    from uncom_bringup.bags.video_bag import write_video_bag  # noqa: PLC0415  (only when it runs)

    folder = Path(stack.enter_context(TemporaryDirectory(prefix="uncom-video-")))
    bag = write_video_bag(path, folder / "video.mcap")
    say(progress.head("video", "without depth, places are known in the picture only"))
    return bag


def run(options: argparse.Namespace) -> int:
    """Understand one recording; 1 if no command was grounded."""
    path = Path(options.file)
    if not path.exists():
        raise BadInputError(f"{path} does not exist")
    from uncom_bringup.bags.bag_reader import BagReader  # noqa: PLC0415
    from uncom_bringup.report.understanding_result import write_result  # noqa: PLC0415
    from uncom_bringup.ros import understand_recording as understand_node  # noqa: PLC0415  (only when it runs)

    begin = time.monotonic()
    files = [Path(name) for name in options.params_file]
    say = output.note if options.json else output.emit
    with ExitStack() as stack:
        bag = stack.enter_context(BagReader(_as_bag(path, stack, say)))
        understand_node.check_bag(bag)
        folder = output_folder(options.out, path.stem, options.force)
        seen = understand_node.understand(bag, folder / "log", rate=options.rate, parameter_files=files, say=say)
        result = write_result(folder, f"UNCOM: {path.name}", seen, begin)
    if options.json:
        output.emit_json(result)
    else:
        say(progress.head("report", result["artifacts"]["report"]))
        if not result["success"]:
            say(f"FAILED: {result['reason']}")
    return 0 if result["success"] else 1
