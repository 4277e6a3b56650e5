# SPDX-License-Identifier: Apache-2.0
"""`uncom version`."""

from __future__ import annotations

import argparse
import re
from importlib import metadata
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import SubParsers


def _version() -> str:
    """Read the version where it is kept: package.xml beside the source, or the metadata of the installed package."""
    package = Path(__file__).resolve().parents[2] / "package.xml"
    if package.exists():
        found = re.search(r"<version>([^<]+)</version>", package.read_text(encoding="utf-8"))
        if found:
            return found.group(1)
    try:
        return metadata.version("uncom_bringup")
    except metadata.PackageNotFoundError:
        return "unknown"


VERSION = _version()


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("version", help="say which version this is")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:  # noqa: ARG001
    """Print the version."""
    output.emit(f"uncom {VERSION}")
    return 0
