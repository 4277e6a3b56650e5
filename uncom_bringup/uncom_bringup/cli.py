# SPDX-License-Identifier: Apache-2.0
"""`uncom`: the one command. Each command is a file in `commands/` and imports what is heavy only when it runs.

Exit status: 0 done, 1 understood but failed (the reason in words), 2 bad use or bad input.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from uncom_common.exceptions import UncomError

from uncom_bringup import output
from uncom_bringup.commands.version import VERSION
from uncom_bringup.exceptions import ExitStatus

COMMANDS = (
    "demo",
    "understand",
    "compare",
    "replay",
    "record",
    "parse",
    "transcribe",
    "point",
    "detect",
    "bench",
    "up",
    "doctor",
    "tunables",
    "test",
    "version",
)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        sys.stderr.write(f"{self.prog}: {message} (see {self.prog} --help)\n")
        raise SystemExit(ExitStatus.BAD_USE)


def build_parser() -> argparse.ArgumentParser:
    """Make the parser of all commands."""
    parser = _Parser(
        prog="uncom",
        description="Command a TIAGo++ by speaking and pointing.",
        epilog="`uncom COMMAND --help` tells more; `uncom setup` makes the environment and `uncom exec CMD` uses it.",
    )
    parser.add_argument("--version", action="version", version=f"uncom {VERSION}")
    parser.add_argument("--verbose", action="store_true", help="log more, to standard error")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    for name in COMMANDS:
        importlib.import_module(f"uncom_bringup.commands.{name}").add_parser(subparsers)
    return parser


def run(arguments: Sequence[str] | None = None) -> int:
    """Parse the command line and run the command; returns the exit status."""
    parser = build_parser()
    options = parser.parse_args(arguments)
    if options.command is None:
        parser.print_help(sys.stderr)
        return ExitStatus.BAD_USE
    logging.basicConfig(
        level=logging.INFO if options.verbose else logging.WARNING,
        format="%(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    output.claim_stdout()
    try:
        return int(options.run(options))
    except UncomError as error:
        output.note(f"uncom {options.command}: {_one_line(error)}")
        return int(getattr(error, "exit_status", ExitStatus.BAD_USE))
    except BrokenPipeError:
        # The reader of our output has gone (`uncom ... | head`); nothing is left to say to anybody.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return ExitStatus.DONE
    except OSError as error:
        output.note(f"uncom {options.command}: {_one_line(error)}")
        return ExitStatus.BAD_USE
    except KeyboardInterrupt:
        output.note(f"uncom {options.command}: interrupted")
        return ExitStatus.INTERRUPTED


def _one_line(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        name = f"{error.filename}: " if error.filename else ""
        return f"{name}{error.strerror}"
    return " ".join(str(error).split())


def main() -> None:
    """Run and exit; a request to end (SIGTERM, a closed terminal) unwinds like Ctrl-C, so that no node stays behind."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: sys.exit(128 + number))
    sys.exit(run())


if __name__ == "__main__":
    main()
