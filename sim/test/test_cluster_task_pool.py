# SPDX-License-Identifier: Apache-2.0
"""Tasks on worker processes: every result once, whoever worked; deaths are told; nothing is left behind."""

import os
import signal
from contextlib import closing
from functools import partial

import psutil
import pytest
from distributed import LocalCluster
from uncom_sim.cluster.options import ClusterLimits
from uncom_sim.cluster.task_pool import PoolOptions, TaskPool
from uncom_sim.exceptions import WorkerDiedError, WorkerError

TASKS = {f"number {i}": i for i in range(6)}


def squared(number):
    return os.getpid(), number**2


def refused(number):
    raise ValueError(f"{number} is refused")


def killed_at_three(number, marks):
    """Kill the process at 3 until so many marks are left in a folder as it has tasks."""
    count = len(list(marks.iterdir()))
    if number == 3 and count < 1:
        (marks / f"{count}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def killed(number):
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def children():
    return {process.pid for process in psutil.Process().children(recursive=True) if process.status() != "zombie"}


def test_every_result_comes_once_from_processes_that_end_with_the_run(tmp_path):
    before = children()
    pool = TaskPool(PoolOptions(jobs=2, log=tmp_path / "log"))
    found = list(pool.run(squared, TASKS))
    assert sorted(square for _, square in found) == [0, 1, 4, 9, 16, 25]
    assert os.getpid() not in {pid for pid, _ in found}
    assert pool.jobs == 2
    assert not {pid for pid, _ in found} & children()
    assert len(children()) <= len(before) + 1  # the resource tracker of multiprocessing stays


def test_a_run_that_is_given_up_leaves_no_process():
    with closing(TaskPool(PoolOptions(jobs=2)).run(squared, TASKS)) as results:
        pid, _ = next(results)
    assert pid not in children()


def test_what_a_task_raises_ends_the_run():
    with pytest.raises(ValueError, match="is refused"):
        list(TaskPool(PoolOptions(jobs=1)).run(refused, {"one": 1}))


def test_without_tasks_nothing_is_started():
    assert list(TaskPool(PoolOptions(scheduler="tcp://127.0.0.1:1")).run(squared, {})) == []


def test_a_task_whose_process_died_is_told_of_and_run_again(tmp_path):
    told = []
    run = partial(killed_at_three, marks=tmp_path)
    found = sorted(TaskPool(PoolOptions(jobs=2), told.append).run(run, TASKS))
    assert found == [0, 1, 4, 9, 16, 25]
    assert len(told) == 1
    assert told[0].startswith("number 3: the process died")


def test_a_task_at_which_processes_die_ends_the_run_with_its_name():
    with pytest.raises(WorkerDiedError, match="lethal: 2 processes died at it") as raised:
        list(TaskPool(PoolOptions(jobs=1)).run(killed, {"lethal": 0}))
    assert raised.value.task == "lethal"


def test_workers_of_a_scheduler_give_the_same_results_and_stay():
    with LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=None) as cluster:
        pool = TaskPool(PoolOptions(scheduler=cluster.scheduler_address))
        first = sorted(square for _, square in pool.run(squared, TASKS))
        again = sorted(square for _, square in pool.run(squared, TASKS))
        assert first == again == [0, 1, 4, 9, 16, 25]
        assert pool.jobs == 4
        assert len(cluster.scheduler_info["workers"]) == 2


def test_a_scheduler_that_is_not_there_is_told_of():
    pool = TaskPool(PoolOptions(scheduler="tcp://127.0.0.1:1"), limits=ClusterLimits(connect_s=0.5))
    with pytest.raises(WorkerError, match=r"no dask scheduler answers at tcp://127\.0\.0\.1:1"):
        list(pool.run(squared, TASKS))
