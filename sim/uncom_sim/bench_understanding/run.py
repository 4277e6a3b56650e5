# SPDX-License-Identifier: Apache-2.0
"""A whole run of the benchmark: plan, make and understand takes in several processes, count, report."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from uncom_sim.bench_understanding.reporting.checkpoint import RunCheckpoint, sources_digest
from uncom_sim.bench_understanding.reporting.page import report_page
from uncom_sim.bench_understanding.reporting.report import report_of
from uncom_sim.bench_understanding.reporting.text import report_text
from uncom_sim.bench_understanding.takes.take_planning import plan_takes
from uncom_sim.bench_understanding.takes.take_synthesis import generator_version
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.bench_understanding.worker import Task, WorkerOptions, run_take
from uncom_sim.cluster.task_pool import PoolOptions, TaskPool


@dataclass(frozen=True, slots=True)
class BenchmarkOptions:
    """What a run is asked for."""

    seed: int
    scenarios: tuple[int, ...]
    takes: int | None
    jobs: int
    folder: Path
    cache: Path
    fresh: bool = False
    variants: bool = True
    bags: Path | None = None
    parameter_files: tuple[Path, ...] = ()
    scheduler: str = ""

    @property
    def pool(self) -> PoolOptions:
        """Where takes are made and understood."""
        return PoolOptions(self.jobs, self.scheduler, self.folder / "workers.log")


@dataclass(frozen=True, slots=True)
class BenchmarkResult:
    """The report as JSON values and as text."""

    report: dict[str, Any]
    text: str


def tasks_of(plans: Sequence[TakePlan]) -> tuple[Task, ...]:
    """Give each take the sentence of the next take of its scenario."""
    by_scenario: dict[int, list[TakePlan]] = {}
    for plan in plans:
        by_scenario.setdefault(plan.scenario, []).append(plan)
    tasks = []
    for plan in plans:
        siblings = by_scenario[plan.scenario]
        other = siblings[(siblings.index(plan) + 1) % len(siblings)]
        tasks.append(Task(plan, other.scene.say if other is not plan else ""))
    return tuple(tasks)


def run_benchmark(options: BenchmarkOptions) -> BenchmarkResult:
    """Run the benchmark; leaves report.json, report.txt and index.html in the folder.

    Raises:
        UncomError: a take cannot be made, a back end not loaded.
    """
    start = time.monotonic()
    plans = plan_takes(options.seed, options.scenarios, options.takes)
    tasks = tasks_of(plans)
    identity = {
        "takes": [plan.key(generator_version()) for plan in plans],
        "variants": options.variants,
        "sources": sources_digest(),
        "parameters": [path.read_text(encoding="utf-8") for path in options.parameter_files],
    }
    checkpoint = RunCheckpoint(options.cache, identity, fresh=options.fresh)
    done = checkpoint.outcomes()
    waiting = [task for task in tasks if task.plan.name not in done]
    console = Console(file=sys.stderr)
    run = partial(run_take, options=worker_options(options))
    pool = TaskPool(options.pool, console.print)
    with progress_bar(console) as bar:
        task = bar.add_task("takes", total=len(plans), completed=len(plans) - len(waiting), right="")
        # By turns, so that what is known of an unfinished run is of all scenarios.
        by_turns = sorted(waiting, key=lambda task: (task.plan.index, task.plan.scenario))
        with closing(pool.run(run, {task.plan.name: task for task in by_turns})) as results:
            for outcome in results:
                checkpoint.add(outcome)
                done[outcome.take] = outcome
                right = sum(one.right for one in done.values())
                bar.update(task, advance=1, right=f"{right} right")
                if not console.is_terminal and len(done) % 10 == 0:
                    console.print(f"{len(done)} of {len(plans)} takes, {right} right")
    outcomes = [done[plan.name] for plan in plans]
    wall_s = time.monotonic() - start
    report = report_of(outcomes, seed=options.seed, jobs=pool.jobs, wall_s=wall_s)
    text = report_text(report)
    (options.folder / "report.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    (options.folder / "report.txt").write_text(text + "\n", encoding="utf-8")
    (options.folder / "takes.jsonl").write_text(
        "".join(json.dumps(one.as_dict()) + "\n" for one in outcomes), encoding="utf-8"
    )
    page = report_page(report, outcomes, options.folder / "pictures")
    (options.folder / "index.html").write_text(page, encoding="utf-8")
    checkpoint.finish()
    return BenchmarkResult(report, text)


def worker_options(options: BenchmarkOptions) -> WorkerOptions:
    """Return what the workers of a run need; paths are absolute, as workers may have another working folder."""
    pictures = options.folder.absolute() / "pictures"
    pictures.mkdir(exist_ok=True)
    return WorkerOptions(
        options.cache.absolute(),
        pictures,
        tuple(path.absolute() for path in options.parameter_files),
        options.variants,
        None if options.bags is None else options.bags.absolute(),
    )


def progress_bar(console: Console) -> Progress:
    """Return a bar with how many takes were right so far."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[right]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    )
