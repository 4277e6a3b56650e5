# SPDX-License-Identifier: Apache-2.0
"""`uncom point`: one picture to hands and pointing rays."""

from __future__ import annotations

import argparse

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, existing_file, read_picture


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("point", help="one picture -> hands and pointing rays")
    parser.add_argument("image", metavar="IMAGE", help="JPEG, PNG, ...")
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Find the hands; none is an answer too."""
    image = read_picture(existing_file(options.image))
    from uncom_perception import hands  # noqa: PLC0415  (only when it runs)

    result = hands.hands_to_json(hands.point_in_image(image))
    if options.json:
        output.emit_json(result)
        return 0
    for number, hand in enumerate(result["hands"]):
        ray = hand["ray"]
        where = "does not point"
        if ray:
            (u, v), (du, dv) = ray["tip"], ray["direction"]
            where = f"points from ({u:.0f}, {v:.0f}) px along ({du:+.2f}, {dv:+.2f})"
        output.emit(f"{hand['handedness']} hand {number}, score {hand['score']:.2f}: {where}")
    if not result["hands"]:
        output.emit("no hand was found")
    return 0
