# SPDX-License-Identifier: Apache-2.0
"""`uncom detect`: one picture and a phrase to boxes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers, add_json, decode_file, existing_file, read_picture
from uncom_bringup.exceptions import BadInputError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from uncom_common.camera import PinholeCamera


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("detect", help="one picture and a phrase -> boxes and masks")
    parser.add_argument("image", metavar="IMAGE", help="JPEG, PNG, ...")
    parser.add_argument("phrase", metavar="PHRASE", help='what to look for: "red mug", "objects", "table", ...')
    parser.add_argument("--depth", metavar="D", help="depth image registered to IMAGE: 16-bit PNG, millimetres")
    parser.add_argument("--camera", metavar="C", help='intrinsics as JSON: {"fx", "fy", "cx", "cy"}')
    parser.add_argument("--lexicon", metavar="FILE", help="YAML file with more words for things")
    add_json(parser)
    parser.set_defaults(run=run)


def read_depth(path: Path) -> npt.NDArray[np.float32]:
    """Read a depth picture as metres (H, W), unknown as NaN.

    Raises:
        BadInputError: it is not a 16-bit PNG, or it is cut short.
    """
    from uncom_bringup.bags import image_codec  # noqa: PLC0415  (OpenCV is slow to import)

    wrong = f"{path} is not a depth picture (16-bit PNG in millimetres), or it is cut short"
    return decode_file(path, image_codec.decode_depth, wrong)


def read_camera(path: Path, shape: Sequence[int]) -> PinholeCamera:
    """Read intrinsics for a picture of a shape (H, W, ...).

    Raises:
        BadInputError: not JSON with the numbers fx, fy, cx, cy.
    """
    from uncom_common.camera import PinholeCamera  # noqa: PLC0415  (NumPy is slow to import)

    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        numbers = [float(data[name]) for name in ("fx", "fy", "cx", "cy")]
    except (ValueError, KeyError, TypeError) as error:
        raise BadInputError(
            f'{path} is not a camera; it must be JSON: {{"fx": .., "fy": .., "cx": .., "cy": ..}}'
        ) from error
    return PinholeCamera(int(shape[1]), int(shape[0]), *numbers)


def run(options: argparse.Namespace) -> int:
    """Look for the phrase; nothing is an answer too."""
    path = existing_file(options.image)
    if (options.depth is None) != (options.camera is None):
        raise BadInputError("--depth and --camera belong together; give both or neither")
    if not options.phrase.strip():
        raise BadInputError('the phrase is empty; say what to look for, for example "red mug"')
    image = read_picture(path)
    depth = read_depth(existing_file(options.depth)) if options.depth else None
    camera = read_camera(existing_file(options.camera), image.shape) if options.camera else None
    if depth is not None and depth.shape != image.shape[:2]:
        raise BadInputError(f"{options.depth} has another size than {path}; depth must be registered to the picture")
    from uncom_perception.rgbd_frame import RgbdFrame  # noqa: PLC0415  (NumPy is slow to import)

    from uncom_perception import objects  # noqa: PLC0415  (only when it runs)

    lexicon = str(existing_file(options.lexicon)) if options.lexicon else ""
    found = objects.detect_in_image(RgbdFrame(image, depth, camera), options.phrase, lexicon)
    result = objects.scene_to_json(found)
    if options.json:
        output.emit_json(result)
        return 0
    for thing in result["detections"]:
        x0, y0, x1, y1 = thing["box"]
        where = f"({x0:.0f}, {y0:.0f})-({x1:.0f}, {y1:.0f}) px"
        if thing.get("centroid_m"):
            where += " at " + ", ".join(f"{value:+.3f}" for value in thing["centroid_m"]) + " m"
        output.emit(f"{thing['score']:.2f}  {thing['label']}  {where}")
    if not result["detections"]:
        output.emit("nothing was found")
    return 0
