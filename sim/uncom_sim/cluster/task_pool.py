# SPDX-License-Identifier: Apache-2.0
"""Independent tasks on worker processes by dask.distributed: a local cluster, or the workers of a scheduler.

A task is a function of one value; both are pickled, and a result depends on them alone: not on the worker, not on
the order. A process runs one task at a time. A task whose process dies is run again by another one; a task at which
several processes have died ends the run.
"""

from __future__ import annotations

import logging
import os
import signal
import tempfile
import threading
import uuid
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import dask
from distributed import Client, KilledWorker, LocalCluster, Worker, WorkerPlugin, as_completed
from distributed.client import FutureCancelledError

from uncom_sim.cluster.options import CLUSTER_LIMITS, ClusterLimits
from uncom_sim.exceptions import WorkerDiedError, WorkerError

TaskT = TypeVar("TaskT")
ResultT = TypeVar("ResultT")

# The models that a process has loaded serve one task; a worker that somebody started may have several threads.
_ONE_TASK = threading.Lock()


@dataclass(frozen=True, slots=True)
class PoolOptions:
    """Where tasks run.

    jobs: processes of the local cluster; scheduler: address of a dask scheduler ("tcp://host:8786") whose workers are
    taken instead, "" for none; log: file for what local workers write to standard output and error, None for ours.
    """

    jobs: int = 1
    scheduler: str = ""
    log: Path | None = None


class TaskPool:
    """Runs tasks by workers that it holds while `run` is under way."""

    def __init__(
        self,
        options: PoolOptions,
        report: Callable[[str], None] = lambda _: None,
        limits: ClusterLimits = CLUSTER_LIMITS,
    ) -> None:
        """Start nothing; report is given a line about each worker that died, in another thread."""
        self._options = options
        self._report = report
        self._limits = limits
        self._jobs = options.jobs

    @property
    def jobs(self) -> int:
        """Return how many tasks run at a time: as asked for locally, as found at a scheduler when `run` began."""
        return self._jobs

    def run(self, function: Callable[[TaskT], ResultT], tasks: Mapping[str, TaskT]) -> Generator[ResultT, None, None]:
        """Yield the results of named tasks as they come; closing the generator ends the local workers.

        Args:
            function: a function of a module that the workers can import, or a partial of one.
            tasks: the tasks by name, in the order in which they are started.

        Raises:
            WorkerDiedError: too many processes died at one task.
            WorkerError: the scheduler does not answer, has no worker, or went away.
            Exception: what the function raised.
        """
        if not tasks:
            return
        # Of this run alone: a scheduler that serves others too must not take their results for ours.
        group = f"uncom-{uuid.uuid4().hex}"
        keys = [(group, name) for name in tasks]
        with self._connect(len(tasks)) as client, self._deaths_reported(client, group):
            futures = client.map(_run_task, list(tasks.values()), key=keys, pure=False, function=function)
            running = as_completed(futures, loop=client.loop)
            del futures  # workers forget a result that was handed over
            for future in running:
                try:
                    result: ResultT = future.result()
                except KilledWorker as error:
                    raise WorkerDiedError(future.key[1], error.allowed_failures + 1, self._options.log) from error
                except FutureCancelledError as error:
                    raise WorkerError(f"the scheduler gave {future.key[1]} up: {error.reason}") from error
                yield result

    @contextmanager
    def _connect(self, tasks: int) -> Iterator[Any]:
        """Connect to the scheduler, or start a local one with no more workers than tasks."""
        _quieten_dask()
        if self._options.scheduler:
            with _remote_client(self._options.scheduler, self._limits) as client:
                self._jobs = sum(client.nthreads().values())
                yield client
        else:
            with _local_client(min(self._options.jobs, tasks), self._options.log, self._limits) as client:
                yield client

    @contextmanager
    def _deaths_reported(self, client: Any, group: str) -> Iterator[None]:
        """Report every worker that ends without having been asked to, and has tasks of this run."""

        def report(event: tuple[float, Mapping[str, Any]]) -> None:
            _, about = event
            if about.get("action") == "remove-worker" and not about["expected"]:
                names = sorted(key[1] for key in about["processing-tasks"] if key[0] == group)
                if names:
                    self._report(f"{', '.join(names)}: the process died (out of memory, or a crash)")

        client.subscribe_topic("all", report)
        try:
            yield
        finally:
            client.unsubscribe_topic("all")


class _LocalWorker(WorkerPlugin):
    """Sends what a worker and its native libraries write to a file; leaves its end to the process that started it."""

    name = "uncom-local-worker"

    def __init__(self, log: str | None) -> None:
        self._log = log

    def setup(self, worker: Worker) -> None:  # noqa: ARG002  (the interface of dask)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if self._log is not None:
            file = os.open(self._log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            os.dup2(file, 1)
            os.dup2(file, 2)
            os.close(file)

    def teardown(self, worker: Worker) -> None:  # noqa: ARG002
        os._exit(0)  # at once: nobody waits for what it is at, nor for native libraries to clean up


def _quieten_dask() -> None:
    """Let dask log nothing unless the whole program logs much: what matters is reported in one line."""
    logger = logging.getLogger("distributed")
    logger.handlers = [logging.NullHandler()]
    logger.propagate = logging.getLogger().isEnabledFor(logging.INFO)


def _run_task(task: TaskT, function: Callable[[TaskT], ResultT]) -> ResultT:
    with _ONE_TASK:
        return function(task)


@contextmanager
def _local_client(workers: int, log: Path | None, limits: ClusterLimits) -> Iterator[Any]:
    """Start processes of one thread each, with equal shares of the memory, and end them.

    Raises:
        WorkerError: a process cannot be started.
    """
    settings = {
        "distributed.scheduler.allowed-failures": limits.deaths_per_task - 1,
        # A worker has the task that it runs and no other, so that its death is that task's.
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.worker.profile.enabled": False,
        # Not to give every freed page back at once, which dask asks the C library for: it takes a third of the time.
        "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": None,
        # Results are small: what a worker holds is the models, and to wait or to spill frees nothing.
        "distributed.worker.memory.target": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.pause": False,
        "distributed.worker.memory.terminate": limits.memory_share,
    }
    with tempfile.TemporaryDirectory(prefix="uncom_workers_") as folder, dask.config.set(settings):
        try:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                # The port of the web server, which dask cannot do without: any free one, of this machine alone.
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                silence_logs=logging.CRITICAL,
                local_directory=folder,
            )
        except (OSError, RuntimeError) as error:
            raise WorkerError(f"the worker processes do not start: {error}") from error
        with cluster, Client(cluster, set_as_default=False) as client:
            client.register_plugin(_LocalWorker(None if log is None else str(log.absolute())))
            yield client


@contextmanager
def _remote_client(scheduler: str, limits: ClusterLimits) -> Iterator[Any]:
    """Connect to a scheduler that somebody started; its workers stay when this ends, without tasks of ours.

    Raises:
        WorkerError: it does not answer, or has no worker.
    """
    try:
        client = Client(scheduler, timeout=limits.connect_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkerError(f"no dask scheduler answers at {scheduler}: {error}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=limits.connect_s)
        except TimeoutError as error:
            raise WorkerError(f"the scheduler at {scheduler} has no worker (`dask worker {scheduler}`)") from error
        yield client
