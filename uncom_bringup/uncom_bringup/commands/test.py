# SPDX-License-Identifier: Apache-2.0
"""`uncom test`: all checks that CI runs, the documentation among them; `--all` adds the slow tests."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from uncom_bringup import output
from uncom_bringup.command_options import ROBOT_PACKAGES, SubParsers
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.options import CHECK

_FOLDERS = (*ROBOT_PACKAGES, "sim")
# First on the path, it makes every import of the simulator fail.
_WITHOUT_SIMULATOR = Path("test") / "without_simulator"


@dataclass(frozen=True, slots=True)
class Check:
    """One command and its name."""

    name: str
    command: tuple[str, ...]
    without_simulator: bool = False


def add_parser(subparsers: SubParsers[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("test", help="all checks that CI runs: ruff, mypy, the tests of every package")
    parser.add_argument("--all", action="store_true", help="also the tests marked slow (some 15 minutes more)")
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help="only these folders (default: all)")
    parser.set_defaults(run=run)


def checks(root: Path, folders: tuple[str, ...], *, everything: bool = False) -> list[Check]:
    """List the checks, cheapest first."""
    python = sys.executable
    packages = tuple(folder for folder in folders if folder != "test")
    found = [
        Check("lint (ruff)", (python, "-m", "ruff", "check", *folders)),
        Check("format (ruff)", (python, "-m", "ruff", "format", "--check", *folders)),
    ]
    sources = [f"{folder}/{'uncom_sim' if folder == 'sim' else folder}" for folder in packages]
    if sources:
        found.append(Check("types (mypy --strict)", (python, "-m", "mypy", *sources)))
    marker = () if everything else ("-m", "not slow")
    for folder in folders:
        tests = folder if folder == "test" else f"{folder}/test"
        if (root / tests).is_dir():
            command = (python, "-m", "pytest", "-q", "--no-header", *marker, tests)
            found.append(Check(f"tests of {folder}", command, without_simulator=folder in ROBOT_PACKAGES))
    if "test" in folders:
        pages = str(root / ".uncom" / "docs")
        found.append(Check("documentation (sphinx)", (python, "-m", "sphinx", "-W", "-q", "-j", "auto", "docs", pages)))
    return found


def run(options: argparse.Namespace) -> int:
    """Run every check even after one has failed; 1 if any has."""
    root = Path(os.environ.get("UNCOM_WORKSPACE", "."))
    if not (root / "pyproject.toml").exists():
        raise BadInputError(
            "`uncom test` runs in the workspace; use ./uncom test there (installed packages: colcon test)"
        )
    known = (*_FOLDERS, "test")
    for package in options.packages:
        if package not in known:
            raise BadInputError(f"no folder {package!r} to test; there are {', '.join(known)}")
    folders = tuple(options.packages) or known
    todo = checks(root, folders, everything=options.all)
    failed = []
    begin = time.monotonic()
    for number, check in enumerate(todo, start=1):
        output.note(f"[{number}/{len(todo)}] {check.name} ...")
        started = time.monotonic()
        good = _run(check, root)
        output.note(
            f"[{number}/{len(todo)}] {check.name}: {'ok' if good else 'FAILED'} ({time.monotonic() - started:.0f} s)"
        )
        if not good:
            failed.append(check.name)
    output.emit(
        f"{len(todo) - len(failed)} of {len(todo)} checks passed in {time.monotonic() - begin:.0f} s"
        + (f"; failed: {', '.join(failed)}" if failed else "")
    )
    return 1 if failed else 0


def _run(check: Check, root: Path) -> bool:
    environment = dict(os.environ)
    if check.without_simulator:
        paths = (str(root / _WITHOUT_SIMULATOR), environment.get("PYTHONPATH", ""))
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    try:
        done = subprocess.run(check.command, cwd=root, env=environment, check=False, timeout=CHECK.timeout_s)  # noqa: S603
    except subprocess.TimeoutExpired:
        output.note(f"{check.name} took longer than {CHECK.timeout_s} s")
        return False
    # pytest says 5 for "no tests": that is not success.
    return done.returncode == 0
