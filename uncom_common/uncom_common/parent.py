# SPDX-License-Identifier: Apache-2.0
"""A process that ends when the one that started it is gone, so that no node is left behind by a killed graph."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

# Set to the process id of the starter for those that shall not outlive it.
STARTER = "UNCOM_STARTER_PID"
_PR_SET_PDEATHSIG = 1  # prctl(2)


def end_with_starter() -> None:
    """Ask for SIGINT when the starter named in the environment ends; without one nothing."""
    starter = os.environ.get(STARTER, "")
    if starter.isdigit():
        end_with(int(starter), signal.SIGINT)


def end_with(starter: int, how: signal.Signals) -> None:
    """Ask the kernel for a signal when the process that started this one ends; off Linux nothing."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(how))
    if os.getppid() != starter:  # it ended before we could ask
        os.kill(os.getpid(), how)
