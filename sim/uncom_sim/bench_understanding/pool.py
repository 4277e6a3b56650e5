# SPDX-License-Identifier: Apache-2.0
"""Worker processes: each loads the cores once and then runs what it is given; no order, no shared state."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import TypeVar

from uncom_common.parent import end_with

from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.worker import StressPoint, StressTask, Task, Worker, WorkerOptions

TaskT = TypeVar("TaskT")
ResultT = TypeVar("ResultT")

_worker: Worker | None = None


def _start_worker(options: WorkerOptions, log: str, starter: int) -> None:
    """Load the cores once in each process; what native libraries print goes to a file."""
    global _worker  # noqa: PLW0603 (one for each process, as the pool's initialiser needs it)
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(file, 1)
    os.dup2(file, 2)
    import cv2  # noqa: PLC0415 (in the worker only)

    cv2.setNumThreads(1)
    end_with(starter, signal.SIGKILL)
    _worker = Worker(options)


def run_take(task: Task) -> Outcome:
    """Run one take in a worker process."""
    return _the_worker().run(task)


def run_stress(task: StressTask) -> list[StressPoint]:
    """Run one take under a difficulty in a worker process."""
    return _the_worker().stress(task)


def _the_worker() -> Worker:
    if _worker is None:
        raise RuntimeError("the worker was not started")
    return _worker


def in_workers(
    run: Callable[[TaskT], ResultT], tasks: Sequence[TaskT], options: WorkerOptions, jobs: int, log: Path
) -> Iterator[ResultT]:
    """Yield the results of tasks as they come."""
    if not tasks:
        return
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    pool = ProcessPoolExecutor(
        max_workers=min(jobs, len(tasks)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_start_worker,
        initargs=(options, str(log), os.getpid()),
    )
    try:
        for future in as_completed([pool.submit(run, task) for task in tasks]):
            yield future.result()
    except BaseException:
        # Interrupted, or a take failed: nobody waits for what the others are at. What is done is in the journal.
        for process in multiprocessing.active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
