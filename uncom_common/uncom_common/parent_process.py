# SPDX-License-Identifier: Apache-2.0
"""A process that ends with its parent process, so that a killed graph leaves no node behind."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from enum import IntEnum

# Environment variable with the process id of the parent, for processes that shall not outlive it.
PARENT_PID_VARIABLE = "UNCOM_STARTER_PID"


class _PrctlOption(IntEnum):
    """Options of prctl(2)."""

    SET_PDEATHSIG = 1


def end_with_named_parent() -> None:
    """Ask for SIGINT when the parent that the environment names ends; do nothing where it names none."""
    pid = os.environ.get(PARENT_PID_VARIABLE, "")
    if pid.isdigit():
        end_with_parent(int(pid), signal.SIGINT)


def end_with_parent(parent_pid: int, death_signal: signal.Signals) -> None:
    """Ask the kernel for a signal to this process when its parent ends; do nothing off Linux."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PrctlOption.SET_PDEATHSIG, int(death_signal))
    if os.getppid() != parent_pid:  # it ended before we could ask
        os.kill(os.getpid(), death_signal)
