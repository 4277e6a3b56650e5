# SPDX-License-Identifier: Apache-2.0
"""Nodes of the graph as processes: started with their parameters, watched, and ended in order."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from uncom_common.parent_process import PARENT_PID_VARIABLE

from uncom_bringup.exceptions import BadInputError, ExitStatus, GraphError
from uncom_bringup.graph.node_specs import NodeSpec
from uncom_bringup.graph.options import PROCESS

_LOG = logging.getLogger(__name__)


ParameterValue = bool | int | float | str | Sequence[bool] | Sequence[int] | Sequence[float] | Sequence[str]


def parameter_text(value: ParameterValue) -> str:
    """Write a parameter value as `-p name:=value` takes it (YAML).

    A string is always quoted, or "yes" would become a bool.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (int, float)):
        return repr(value)
    return "[" + ", ".join(parameter_text(item) for item in value) + "]"


def node_command(
    spec: NodeSpec, parameters: Mapping[str, ParameterValue], parameter_files: Iterable[Path] = ()
) -> list[str]:
    """Build the command line of a node: shipped file, then the caller's files, then single parameters (last wins)."""
    command = [sys.executable, "-m", spec.module, "--ros-args"]
    files = ([spec.parameter_file] if spec.parameter_file else []) + list(parameter_files)
    for path in files:
        command += ["--params-file", str(path)]
    for name, value in parameters.items():
        command += ["-p", f"{name}:={parameter_text(value)}"]
    return command


@dataclass(slots=True)
class _Running:
    spec: NodeSpec
    process: subprocess.Popen[bytes]
    log: Path


class GraphProcesses:
    """The nodes of one graph as processes of their own, each with a log file.

    Every node is started in a session of its own, so that Ctrl-C reaches them through `stop` and in order.
    """

    def __init__(self, log_dir: Path, domain: int, parameter_files: Sequence[Path] = (), threads: int = 1) -> None:
        """Prepare; nothing runs yet.

        Raises:
            BadInputError: a parameter file does not exist.
        """
        for path in parameter_files:
            if not path.is_file():
                raise BadInputError(f"parameter file {path} does not exist")
        self._log_dir = log_dir
        self._files = tuple(parameter_files)
        self._running: list[_Running] = []
        self._environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "PYTHONUNBUFFERED": "1",
            PARENT_PID_VARIABLE: str(os.getpid()),
            # Seven processes share few cores: a thread pool in each only makes them wait for one another.
            **{name: os.environ.get(name, str(threads)) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")},
        }

    def start(self, spec: NodeSpec, parameters: Mapping[str, ParameterValue] | None = None) -> None:
        """Start one node; its output goes to `<name>.log` in the log directory."""
        self._log_dir.mkdir(parents=True, exist_ok=True)
        log = self._log_dir / f"{spec.name}.log"
        command = node_command(spec, parameters or {}, self._files)
        _LOG.info("starting %s", " ".join(command))
        with log.open("wb") as stream:
            process = subprocess.Popen(  # noqa: S603  (our own interpreter and modules)
                command,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=self._environment,
                start_new_session=True,
            )
        self._running.append(_Running(spec, process, log))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the nodes started."""
        return tuple(running.spec.name for running in self._running)

    def check(self) -> None:
        """Look whether every node still runs.

        Raises:
            GraphError: one has ended, with its last lines.
        """
        for running in self._running:
            status = running.process.poll()
            if status is not None:
                how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
                error = GraphError(running.spec.name, f"{how} (log: {running.log})", last_lines(running.log))
                # A node that refuses its parameters says so by status 2: then what the user gave is at fault.
                error.exit_status = ExitStatus.BAD_USE if status == ExitStatus.BAD_USE else GraphError.exit_status
                raise error

    def cpu_times_s(self) -> dict[str, float]:
        """Return the processor time of each node so far [s]; empty where /proc does not tell."""
        ticks = os.sysconf("SC_CLK_TCK")
        times = {}
        for running in self._running:
            try:
                text = Path(f"/proc/{running.process.pid}/stat").read_text(encoding="utf-8")
            except OSError:
                continue
            # The second field, the program's name in parentheses, may hold blanks.
            user, system = text.rpartition(")")[2].split()[11:13]
            times[running.spec.name] = (int(user) + int(system)) / ticks
        return times

    def stop(self, timeout_s: float = PROCESS.stop_timeout_s) -> None:
        """End every node: SIGINT in reverse order of starting, SIGKILL for what is left after `timeout_s`."""
        for running in reversed(self._running):
            _signal(running.process, signal.SIGINT)
        deadline = time.monotonic() + timeout_s
        for running in reversed(self._running):
            try:
                running.process.wait(max(PROCESS.min_wait_s, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                _LOG.warning("%s did not stop by itself; killed", running.spec.name)
                _signal(running.process, signal.SIGKILL)
                running.process.wait()
        self._running.clear()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop everything."""
        self.stop()


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    if process.poll() is None:
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            _LOG.debug("process %d is gone already", process.pid)


def last_lines(log: Path, count: int = PROCESS.log_tail_lines) -> list[str]:
    """Return the last lines of a log file; none if it cannot be read."""
    try:
        return log.read_text(encoding="utf-8", errors="replace").splitlines()[-count:]
    except OSError:
        return []
