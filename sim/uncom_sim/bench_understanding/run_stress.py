# SPDX-License-Identifier: Apache-2.0
"""The stress curves: all takes at every level of every difficulty; tables, JSON and plots."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from uncom_sim.bench_understanding.judging.statistics import wilson
from uncom_sim.bench_understanding.judging.stress import CURVES
from uncom_sim.bench_understanding.options import STRESS, StressOptions
from uncom_sim.bench_understanding.run import BenchmarkOptions, BenchmarkResult, progress_bar, worker_options
from uncom_sim.bench_understanding.takes.take_planning import plan_takes
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.bench_understanding.worker import StressPoint, StressTask, run_stress
from uncom_sim.cluster.task_pool import TaskPool


def run_stress_curves(options: BenchmarkOptions, *, stress_options: StressOptions = STRESS) -> BenchmarkResult:
    """Measure the curves; leaves stress.json, stress.txt and a plot of each in the folder.

    Raises:
        UncomError: a take cannot be made, a back end not loaded.
    """
    start = time.monotonic()
    plans = plan_takes(options.seed, options.scenarios, options.takes or stress_options.takes)
    tasks = stress_tasks(plans)
    points: list[StressPoint] = []
    console = Console(file=sys.stderr)
    run = partial(run_stress, options=worker_options(options))
    pool = TaskPool(options.pool, console.print)
    with progress_bar(console) as bar:
        task = bar.add_task("stress", total=len(tasks), right="")
        with closing(pool.run(run, {one.name: one for one in tasks})) as results:
            for found in results:
                points += found
                bar.update(task, advance=1)
    report: dict[str, Any] = {
        "takes": len(plans),
        "seed": options.seed,
        "wall_s": round(time.monotonic() - start, 1),
        "curves": curves_of(points),
    }
    text = _text(report)
    (options.folder / "stress.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    (options.folder / "stress.txt").write_text(text + "\n", encoding="utf-8")
    for curve in report["curves"]:
        _plot(curve, options.folder / f"stress_{curve['name'].replace(' ', '_').replace('-', '_')}.png")
    return BenchmarkResult(report, text)


def stress_tasks(plans: Sequence[TakePlan]) -> tuple[StressTask, ...]:
    """Return a task for every take and curve, and for every level that has to be filmed."""
    tasks: list[StressTask] = []
    for plan in plans:
        for curve in CURVES:
            levels: tuple[float, ...] = curve.levels if curve.filmed else (0.0,)
            tasks += [StressTask(plan, curve.name, level) for level in levels]
    return tuple(tasks)


def curves_of(points: Sequence[StressPoint]) -> list[dict[str, Any]]:
    """Count the right takes at every level."""
    curves = []
    for curve in CURVES:
        levels = []
        for level in curve.levels:
            at = [p.right for p in points if (p.curve, p.level) == (curve.name, level)]
            low, high = wilson(sum(at), len(at))
            levels.append(
                {"level": level, "takes": len(at), "right": sum(at), "interval": [round(low, 4), round(high, 4)]}
            )
        curves.append({"name": curve.name, "unit": curve.unit, "levels": levels})
    return curves


def _text(report: dict[str, Any]) -> str:
    lines = []
    for curve in report["curves"]:
        lines.append(f"{curve['name']}, {curve['unit']}")
        for at in curve["levels"]:
            share = 100.0 * at["right"] / max(at["takes"], 1)
            low, high = (100.0 * value for value in at["interval"])
            counted = f"{at['right']:>3} of {at['takes']:<3}"
            lines.append(f"  {at['level']:>6g}  {counted}  {share:5.1f} %  ({low:.0f} to {high:.0f} %)")
    lines.append(f"seed {report['seed']}, {report['takes']} takes, {report['wall_s'] / 60.0:.1f} min")
    return "\n".join(lines)


def _plot(curve: dict[str, Any], path: Path) -> None:
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow to load)

    figure = Figure(figsize=(5.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    levels = [at["level"] for at in curve["levels"] if at["takes"]]
    share = [at["right"] / at["takes"] for at in curve["levels"] if at["takes"]]
    spans = [at["interval"] for at in curve["levels"] if at["takes"]]
    axes.fill_between(levels, [low for low, _ in spans], [high for _, high in spans], alpha=0.2, linewidth=0)
    axes.plot(levels, share, marker="o")
    axes.set(xlabel=f"{curve['name']}: {curve['unit']}", ylabel="takes understood", ylim=(0.0, 1.03))
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=130)
