# SPDX-License-Identifier: Apache-2.0
"""`uncom detect`: one picture and a phrase to boxes."""

from __future__ import annotations

import argparse
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.commands.common import SubParsers, add_json, existing_file
from uncom_bringup.exceptions import BadInputError


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("detect", help="one picture and a phrase -> boxes and masks")
    parser.add_argument("image", metavar="IMAGE", help="JPEG, PNG, ...")
    parser.add_argument("phrase", metavar="PHRASE", help='what to look for: "red mug", "objects", "table", ...')
    parser.add_argument("--depth", metavar="D", help="depth image registered to IMAGE: 16-bit PNG, millimetres")
    parser.add_argument("--camera", metavar="C", help='intrinsics as JSON: {"fx", "fy", "cx", "cy"}')
    add_json(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Look for the phrase; nothing is an answer too."""
    image = existing_file(options.image)
    depth: Path | None = existing_file(options.depth) if options.depth else None
    camera: Path | None = existing_file(options.camera) if options.camera else None
    if (depth is None) != (camera is None):
        raise BadInputError("--depth and --camera belong together; give both or neither")
    if not options.phrase.strip():
        raise BadInputError('the phrase is empty; say what to look for, for example "red mug"')
    from uncom_perception import objects  # noqa: PLC0415  (only when it runs)

    result = objects.scene_to_json(objects.detect_in_image(image, options.phrase, depth, camera))
    if options.json:
        output.emit_json(result)
        return 0
    for found in result["detections"]:
        x0, y0, x1, y1 = found["box"]
        where = f"({x0:.0f}, {y0:.0f})-({x1:.0f}, {y1:.0f}) px"
        if found.get("centroid_m"):
            where += " at " + ", ".join(f"{value:+.3f}" for value in found["centroid_m"]) + " m"
        output.emit(f"{found['score']:.2f}  {found['label']}  {where}")
    if not result["detections"]:
        output.emit("nothing was found")
    return 0
