# SPDX-License-Identifier: Apache-2.0
"""Evaluation of one take from its plan to its outcome, in a worker process that keeps the models loaded."""

from __future__ import annotations

import functools
import logging
import time
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
from uncom_bringup.chain.chain import Chain, ChainResult, Grounding
from uncom_bringup.chain.config import load_chain_config
from uncom_language.types import Act

from uncom_sim.bench_understanding.judging.ablations import run_ablations
from uncom_sim.bench_understanding.judging.decision_quality import assess_decision
from uncom_sim.bench_understanding.judging.failure_stage import explain_miss, first_wrong_stage
from uncom_sim.bench_understanding.judging.outcome import Outcome
from uncom_sim.bench_understanding.judging.stress import CURVES, perturbed_evaluation, rerendered_plan
from uncom_sim.bench_understanding.judging.verdict import Verdict, judge
from uncom_sim.bench_understanding.reporting.miss_pictures import draw_miss
from uncom_sim.bench_understanding.takes.recording import TakeRecording, load_take, save_take
from uncom_sim.bench_understanding.takes.scenarios import scenario
from uncom_sim.bench_understanding.takes.take_synthesis import generator_version, make_take
from uncom_sim.bench_understanding.takes.types import TakePlan
from uncom_sim.exceptions import SimError

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class WorkerOptions:
    """What every worker needs: where takes, pictures of misses and bags are kept, and parameters of the nodes."""

    cache: Path
    pictures: Path | None = None
    parameter_files: tuple[Path, ...] = ()
    variants: bool = True
    bags: Path | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """One take to be run; swapped is the sentence of another take of the scenario ("" for none)."""

    plan: TakePlan
    swapped: str = ""


@dataclass(frozen=True, slots=True)
class StressTask:
    """One take under one difficulty; the level counts only for one that has to be filmed."""

    plan: TakePlan
    curve: str
    level: float = 0.0

    @property
    def name(self) -> str:
        """Return a name that no other task of a run has."""
        return f"{self.plan.name} {self.curve} {self.level:g}"


@dataclass(frozen=True, slots=True)
class StressPoint:
    """Whether a take was right at a level of a difficulty."""

    curve: str
    level: float
    take: str
    right: bool


class Worker:
    """Makes and understands takes; what comes out depends on the take alone, not on those before."""

    def __init__(self, options: WorkerOptions) -> None:
        """Load the models of speech, hands and objects.

        Raises:
            UncomError: a back end cannot be loaded, or a parameter is wrong.
        """
        self._options = options
        self._chain = Chain(load_chain_config(options.parameter_files))

    @property
    def chain(self) -> Chain:
        """The chained cores."""
        return self._chain

    def take_path(self, plan: TakePlan) -> Path:
        """Return where a take is kept."""
        return self._options.cache / "takes" / f"{plan.key(generator_version())}.take"

    def recording(self, plan: TakePlan) -> tuple[TakeRecording, float]:
        """Return a take, from the cache or made now, and the processor time it took to make [s]."""
        path = self.take_path(plan)
        if path.exists():
            try:
                return load_take(path), 0.0
            except SimError as error:
                _LOG.warning("%s; it is made again", error)
        start = time.process_time()
        save_take(path, make_take(plan), plan.as_dict())
        # What is understood is what was stored, so that the first run and the next ones are the same.
        return load_take(path), time.process_time() - start

    def run(self, task: Task) -> Outcome:
        """Make (or find) a take, understand it, judge it, and see what others would have made of it."""
        plan = task.plan
        recording, made_s = self.recording(plan)
        if self._options.bags is not None:
            from uncom_sim.bench_understanding.ros.take_bag import write_bag  # noqa: PLC0415  (needs ROS, as nothing else here does)

            write_bag(recording, self._options.bags / f"{plan.name}.mcap", force=True)
        start = time.process_time()
        until_s = recording.truth.words[-1].end_s + self._chain.config.reasoner.late_pointing_s
        result = self._chain.understand(recording, until_s)
        latency = {**result.latency_s, "all": time.process_time() - start}
        first = first_command(result)
        verdict = judge(plan, recording.truth.states, first.decision.grounded if first else None)
        outcome = replace(
            outcome_of(plan, result, verdict),
            made_s=made_s,
            latency_s=latency,
            key=plan.key(generator_version()),
        )
        if first is not None and first.evidence is not None:
            deciding = assess_decision(self._chain.conversation(), plan, recording.truth.states, first.evidence)
            tables = deciding.pop("tables")
            outcome = replace(outcome, notes={**outcome.notes, "deciding": deciding, "tables": tables})
        if not self._options.variants and verdict.right:
            return outcome
        ablations = run_ablations(self._chain, plan, recording, result, first, task.swapped)
        variants = {name: one.right for name, one in ablations.verdicts.items()}
        outcome = replace(outcome, variants=variants, swapped_fits=ablations.swapped_fits)
        if verdict.right:
            return outcome
        command = first.command if first else None
        evidence = first.evidence if first else None
        stage, detail = first_wrong_stage(plan, recording, command, ablations.true_command, evidence)
        pictures = () if self._options.pictures is None else draw_miss(self._options.pictures, plan, recording, first)
        return replace(outcome, stage=stage, why=explain_miss(verdict, stage, detail), pictures=pictures)

    def stress(self, task: StressTask) -> list[StressPoint]:
        """Run one take through all levels of one difficulty, or through one level that has to be filmed."""
        plan, curve = task.plan, next(one for one in CURVES if one.name == task.curve)
        if not curve.filmed:
            right = perturbed_evaluation(self._chain, plan, self.recording(plan)[0], curve.name)
            return [StressPoint(curve.name, level, plan.name, right(level)) for level in curve.levels]
        changed = rerendered_plan(plan, curve.name, task.level)
        if changed is None:
            return []
        recording, _ = self.recording(changed)
        first = first_command(self._chain.understand(recording))
        verdict = judge(changed, recording.truth.states, first.decision.grounded if first else None)
        return [StressPoint(curve.name, task.level, plan.name, verdict.right)]


@functools.lru_cache(maxsize=1)
def _loaded_worker(options: WorkerOptions) -> Worker:
    """Return the worker of this process; it is made at the first task, and again where the options change."""
    cv2.setNumThreads(1)
    return Worker(options)


def run_take(task: Task, options: WorkerOptions) -> Outcome:
    """Run one take in a worker process."""
    return _loaded_worker(options).run(task)


def run_stress(task: StressTask, options: WorkerOptions) -> list[StressPoint]:
    """Run one take under a difficulty in a worker process."""
    return _loaded_worker(options).stress(task)


def first_command(result: ChainResult) -> Grounding | None:
    """Return what was made of the first command, or of what was refused; each take has one sentence."""
    commands = [g for g in result.groundings if g.command.act is Act.COMMAND]
    return next(iter(commands or result.groundings), None)


def outcome_of(plan: TakePlan, result: ChainResult, verdict: Verdict) -> Outcome:
    """Put the outcome of a take together."""
    meaning = plan.meaning
    got = {
        "status": verdict.status,
        "object": verdict.object,
        "target": verdict.target,
        "place": verdict.place,
        "action": verdict.action,
        "relation": verdict.relation,
    }
    return Outcome(
        take=plan.name,
        scenario=plan.scenario,
        index=plan.index,
        seed=plan.seed,
        manner=plan.manner,
        subjects=scenario(plan.scenario).subjects(),
        said=plan.scene.say,
        heard=" / ".join(transcript.text for transcript in result.transcripts),
        meant={
            "object": _described_object(plan, "object"),
            "relation": meaning.relation,
            "target": _described_object(plan, meaning.target),
            "place": meaning.area,
        },
        got={
            **got,
            "object": _described_object(plan, verdict.object),
            "target": _described_object(plan, got["target"]),
        },
        right=verdict.right,
        why=verdict.why,
        relation=meaning.relation,
        understood_relation=verdict.relation or "nothing",
    )


def _described_object(plan: TakePlan, name: object) -> str | None:
    """Return an id with what it is: "target_rival_1 (green bowl)"."""
    if not isinstance(name, str):
        return None
    obj = plan.scene.object(name)
    return f"{name} ({obj.kind if obj.kind == obj.colour else f'{obj.colour} {obj.kind}'})"
