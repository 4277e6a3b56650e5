# SPDX-License-Identifier: Apache-2.0
"""Options, argument types and checks of input files that several commands share."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from uncom_bringup import output
from uncom_bringup.exceptions import BadInputError, OutputExistsError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

Picture = TypeVar("Picture")
# `subparsers` is private to argparse by name only.
SubParsers = argparse._SubParsersAction  # noqa: SLF001
# The packages that a robot needs; the simulator comes beside them.
ROBOT_PACKAGES = (
    "uncom_common",
    "uncom_language",
    "uncom_perception",
    "uncom_reasoner",
    "uncom_tiago_exec",
    "uncom_bringup",
)
SIMULATOR_PACKAGE = "uncom_sim"


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json`."""
    parser.add_argument("--json", action="store_true", help="one JSON object on standard output, nothing else there")


def add_output(parser: argparse.ArgumentParser, what: str) -> None:
    """Add `--out`, where to leave what there is to leave, and `--force`; see output_folder."""
    parser.add_argument("--out", metavar="DIR", help=f"where to leave {what} (default: a new folder)")
    parser.add_argument("--force", action="store_true", help="write into --out though it holds something")


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Add `--params-file`; it may be given several times."""
    parser.add_argument("--params-file", action="append", default=[], metavar="YAML", help="node parameters over ours")


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add `--jobs` and `--scheduler`: where independent runs of a benchmark are worked on."""
    parser.add_argument(
        "--jobs", type=positive_number, default=os.cpu_count() or 1, metavar="N", help="processes on this machine"
    )
    parser.add_argument(
        "--scheduler",
        default="",
        metavar="ADDRESS",
        help="run on the workers of this dask scheduler (tcp://host:8786) instead; they need our folders",
    )


@contextmanager
def simulator_needed(otherwise: str = "`uncom doctor` says what is") -> Iterator[None]:
    """Context to import parts of the simulator in; `otherwise` is the advice where it is not installed.

    Raises:
        BadInputError: it is not installed.
    """
    try:
        yield
    except ImportError as error:
        raise BadInputError(f"the simulator is not installed here ({error}); {otherwise}") from error


def existing_file(text: str) -> Path:
    """Check a file given on the command line.

    Raises:
        BadInputError: there is no such file, or it is a folder or empty.
    """
    path = Path(text)
    if not path.exists():
        raise BadInputError(f"{path} does not exist")
    if path.is_dir():
        raise BadInputError(f"{path} is a folder; a file is needed")
    if path.stat().st_size == 0:
        raise BadInputError(f"{path} is empty")
    return path


def read_picture(path: Path) -> npt.NDArray[np.uint8]:
    """Read a picture file as RGB (H, W, 3); one that is damaged but can be read is told of in one line.

    Raises:
        BadInputError: it is no picture, or it is cut short.
    """
    from uncom_bringup.bags import image_codec  # noqa: PLC0415  (OpenCV is slow to import)

    wrong = f"{path} is not a picture that can be read (JPEG, PNG, BMP, TIFF, WebP), or it is cut short"
    return decode_file(path, image_codec.decode_colour, wrong)


def decode_file(path: Path, decode: Callable[[bytes], Picture], wrong: str) -> Picture:
    """Decode a file; `wrong` is the error for one that cannot be. Lines of OpenCV and libpng are not shown to users.

    Raises:
        BadInputError: `decode` does.
    """
    data = path.read_bytes()
    try:
        with output.captured_stderr() as lines:
            picture = decode(data)
    except BadInputError as error:
        raise BadInputError(wrong) from error
    if lines:
        output.note(f"uncom: {path} is damaged; what could be read of it is used")
    return picture


def positive_float(text: str) -> float:
    """Read a number above 0 (an argparse type)."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def natural_float(text: str) -> float:
    """Read a number from 0 on (an argparse type)."""
    return 0.0 if text.strip() in ("0", "0.0") else positive_float(text)


def natural_number(text: str) -> int:
    """Read 0, 1, 2, ... (an argparse type)."""
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 0 <= value < 2**31:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to {2**31 - 1}")
    return value


def positive_number(text: str) -> int:
    """Read 1, 2, ... (an argparse type)."""
    value = natural_number(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return value


def output_folder(wanted: str | None, default_stem: str, force: bool) -> Path:
    """Choose (and make) the folder for what a run leaves behind.

    Where `wanted` is None it is a new folder: `uncom_out/<default_stem>`, or that with -2, -3, ... appended.

    Raises:
        OutputExistsError: the wanted folder holds something and `force` is not given.
        BadInputError: the wanted folder is a file.
    """
    if wanted is not None:
        path = Path(wanted)
        if path.exists() and not path.is_dir():
            raise BadInputError(f"--out {path} is a file; a folder is needed")
        if path.exists() and any(path.iterdir()) and not force:
            raise OutputExistsError(path)
        path.mkdir(parents=True, exist_ok=True)
        return path
    base = Path("uncom_out")
    number = 1
    while True:
        path = base / (default_stem if number == 1 else f"{default_stem}-{number}")
        try:
            path.mkdir(parents=True)
        except FileExistsError:
            number += 1
        else:
            return path
