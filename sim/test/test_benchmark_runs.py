# SPDX-License-Identifier: Apache-2.0
"""Whole runs of the benchmark: results depend on the takes alone; the graph of nodes answers as the chain does."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import pytest
from distributed import LocalCluster
from uncom_bringup.monitor import run_record
from uncom_bringup.ros.understand_recording import understand_in_process
from uncom_common.conversions import primitive_to_msg
from uncom_sim.bench_understanding import run as benchmark
from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.ros.take_bag import write_bag
from uncom_sim.bench_understanding.takes.scenarios import scenario
from uncom_sim.bench_understanding.takes.take_planning import plan_take, plan_takes
from uncom_sim.bench_understanding.takes.types import Conditions
from uncom_sim.bench_understanding.worker import Task, Worker, WorkerOptions, first_command, run_take
from uncom_sim.cluster.task_pool import PoolOptions, TaskPool

DOMAIN = 91


def without_times(outcome: Outcome) -> dict[str, object]:
    kept = outcome.as_dict()
    for name in ("latency_s", "made_s", "pictures"):
        kept.pop(name)
    return json.loads(json.dumps(kept))


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def worker(cache):
    return Worker(WorkerOptions(cache))


def _nothing_is_left_to_run(self, function, tasks):
    assert not tasks
    yield from ()


def hard_to_see(plan):
    """Return the take in a dark room and with long exposures: most such takes are missed."""
    return replace(plan, conditions=Conditions(light=0.25, camera_noise=2.0, exposure_s=0.06))


def node_answer(worker, plan, tmp_path):
    """Return what the graph of nodes makes of the take's bag."""
    bag = write_bag(worker.recording(plan)[0], tmp_path / f"{plan.name}.mcap", force=True)
    record = understand_in_process(bag, domain=DOMAIN).record
    heard = " / ".join(event.data["text"] for event in record.of(run_record.TRANSCRIPT))
    grounded = record.of(run_record.GROUNDED)
    return heard, grounded[0].data if grounded else None


def assert_same_answer(worker, plan, tmp_path):
    result = worker.chain.understand(worker.recording(plan)[0])
    heard, nodes = node_answer(worker, plan, tmp_path)
    assert heard == " / ".join(t.text for t in result.transcripts), plan.name
    first = first_command(result)
    if nodes is None or first is None:
        assert (nodes is None) == (first is None), plan.name
        return
    own = first.decision.grounded
    assert (nodes["status"], nodes["primitive"], nodes["relation"]) == (
        own.status.value,
        primitive_to_msg(own.primitive),
        own.relation,
    ), plan.name
    assert nodes["object_probability"] == pytest.approx(own.object_probability, abs=1e-4), plan.name
    assert nodes["target_probability"] == pytest.approx(own.target_probability, abs=1e-4), plan.name
    if own.object is not None:
        x, y, _ = own.object.geometry.centroid
        assert nodes["object"]["centroid"]["x"] == pytest.approx(x, abs=1e-3), plan.name
        assert nodes["object"]["centroid"]["y"] == pytest.approx(y, abs=1e-3), plan.name
    if own.target.pose is not None:
        position = nodes["target"]["pose"]["position"]
        assert position["x"] == pytest.approx(own.target.pose[0, 3], abs=1e-3), plan.name
        assert position["y"] == pytest.approx(own.target.pose[1, 3], abs=1e-3), plan.name


def test_the_graph_of_nodes_answers_as_the_chain_does_on_a_takes_bag(worker, tmp_path):
    assert_same_answer(worker, plan_take(scenario(7), 0, 3), tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_the_graph_of_nodes_answers_as_the_chain_does_on_twelve_takes_misses_among_them(worker, tmp_path):
    plans = [*plan_takes(3, takes=9), *(hard_to_see(p) for p in plan_takes(3, (6, 15, 17), takes=4))]
    misses = 0
    for plan in plans:
        assert_same_answer(worker, plan, tmp_path)
        misses += not worker.run(Task(plan)).right
    assert len(plans) >= 12
    assert misses >= 1


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_results_depend_on_neither_jobs_nor_order_nor_the_cache_nor_the_scheduler(cache, tmp_path):
    tasks = benchmark.tasks_of(plan_takes(3, takes=4))
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        pools = (
            (PoolOptions(1), tasks, cache),
            (PoolOptions(3, log=tmp_path / "log"), tasks[::-1], tmp_path),
            (PoolOptions(scheduler=cluster.scheduler_address), tasks[::-1], cache),
        )
        runs = []
        for options, order, folder in pools:
            run = partial(run_take, options=WorkerOptions(folder))
            found = TaskPool(options).run(run, {task.plan.name: task for task in order})
            runs.append(sorted((without_times(one) for one in found), key=lambda one: str(one["take"])))
    assert runs[0] == runs[1] == runs[2]


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_run_leaves_its_report_and_one_that_was_interrupted_goes_on(cache, tmp_path, monkeypatch):
    options = benchmark.BenchmarkOptions(3, (7,), None, 1, tmp_path, cache, variants=False)
    first = benchmark.run_benchmark(options)
    assert first.report["takes"] == 1
    assert json.loads((tmp_path / "report.json").read_text())["scenarios"][0]["id"] == 7
    assert "scenario" in (tmp_path / "report.txt").read_text()
    assert "<html" in (tmp_path / "index.html").read_text()
    known = Outcome.from_dict(json.loads((tmp_path / "takes.jsonl").read_text()))

    class Interrupted(benchmark.RunCheckpoint):
        def outcomes(self):
            return {known.take: known}

    monkeypatch.setattr(benchmark, "RunCheckpoint", Interrupted)
    monkeypatch.setattr(benchmark.TaskPool, "run", _nothing_is_left_to_run)
    again = benchmark.run_benchmark(options)
    assert again.report["right"] == first.report["right"]
