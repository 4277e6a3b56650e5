# SPDX-License-Identifier: Apache-2.0
"""What commands write: results to standard output, everything else to standard error.

Native libraries (PyBullet, TensorFlow Lite) write to file descriptor 1 behind Python's back. `claim_stdout` keeps
the real standard output for results and turns descriptor 1 into standard error.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO


class _Streams:
    """The stream that results go to; standard output until it is claimed."""

    results: TextIO | None = None


def claim_stdout() -> None:
    """Keep standard output for `emit` and `emit_json` alone; whatever else is written there goes to standard error."""
    if _Streams.results is not None:
        return
    try:
        sys.stdout.flush()
        results = os.dup(1)
        os.dup2(2, 1)
    except (OSError, ValueError):  # no real descriptors, as under a test's capture
        return
    _Streams.results = os.fdopen(results, "w", encoding="utf-8")


def _results() -> TextIO:
    return _Streams.results or sys.stdout


def emit(line: str = "") -> None:
    """Write one line of a result."""
    stream = _results()
    stream.write(line + "\n")
    stream.flush()


def emit_json(value: Any) -> None:
    """Write one JSON value as one line."""
    emit(json.dumps(value, ensure_ascii=False, allow_nan=False))


def note(line: str) -> None:
    """Write one line for the person who waits: progress, warnings."""
    sys.stderr.write(line + "\n")
    sys.stderr.flush()


@contextmanager
def captured_stderr() -> Iterator[list[str]]:
    """Capture what native libraries write to descriptor 2 in this context; the list has its lines afterwards.

    For short calls whose result tells how they ended, so that the caller can word the message.
    """
    lines: list[str] = []
    try:
        sys.stderr.flush()
        errors = os.dup(2)
    except (OSError, ValueError):  # no real descriptors
        yield lines
        return
    with tempfile.TemporaryFile() as kept:
        os.dup2(kept.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(errors, 2)
            os.close(errors)
            kept.seek(0)
            lines += kept.read().decode("utf-8", "replace").splitlines()
