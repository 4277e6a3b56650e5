# SPDX-License-Identifier: Apache-2.0
"""`uncom bench execution`: single commands carried out by physics, faster than real time, judged by the truth.

Each command is grounded by the real detector on a rendered picture; speech and gestures are left out.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from ompl import util as ou
from PIL import Image
from uncom_common.primitive import Primitive
from uncom_perception.types import Detection
from uncom_perception.types import Scene as Seen
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.types import ManipulationTask, Outcome, Status

from uncom_sim.bench_execution.cases import Case, make_case
from uncom_sim.bench_execution.options import RUNS, RunOptions
from uncom_sim.bench_execution.stepped_robot import Estimate, SteppedRobot
from uncom_sim.cluster.task_pool import PoolOptions, TaskPool
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.scoring.acts import ActObserver, judge_act
from uncom_sim.scoring.end_state import PhysicalResult, judge
from uncom_sim.types import ObjectState
from uncom_sim.world.simulator import Simulator


@dataclass(frozen=True, slots=True)
class Run:
    """What came of one command."""

    case: Case
    outcome: Outcome
    physical: PhysicalResult
    told: tuple[Status, ...]
    forces: dict[str, float] = field(default_factory=dict)
    table_touches: int = 0
    bystander_touches: int = 0
    home_error: float = 0.0
    base_error_m: float = 0.0
    simulated_s: float = 0.0
    processor_s: float = 0.0

    @property
    def succeeded(self) -> bool:
        """Whether robot and physics both say so, it never touched the table, and is back unless it holds something."""
        back = (
            self.case.primitive in (Primitive.PICK, Primitive.GIVE)
            or max(self.home_error, self.base_error_m) < RUNS.home_tolerance
        )
        return self.outcome.success and self.physical.success and self.table_touches == 0 and back

    def as_dict(self) -> dict[str, Any]:
        """Return the run as the benchmark's JSON has it."""
        plans = [s.data for s in self.told if "planning_s" in s.data]
        return {
            "case": self.case.number,
            "kind": self.case.kind,
            "relation": self.case.relation,
            "target": "" if self.case.meaning.target is None else self.case.scene.object(self.case.meaning.target).kind,
            "clutter": len(self.case.scene.objects),
            "arm": next((s.arm for s in reversed(self.told) if s.arm), ""),
            "success": self.succeeded,
            "stage": self.outcome.stage.name,
            "said": self.outcome.reason,
            "physics": self.physical.reason,
            "attempts": len(plans),
            "planning_s": [p["planning_s"] for p in plans],
            "motion_s": [p["motion_s"] for p in plans],
            "grasp": [p.get("grasp", {}).get("family", "") for p in plans],  # type: ignore[attr-defined]
            "others_moved_m": round(self.physical.others_moved_m, 4),
            "table_touches": self.table_touches,
            "bystander_touches": self.bystander_touches,
            "forces_n": self.forces,
            "home_error": round(self.home_error, 4),
            "base_error_m": round(self.base_error_m, 4),
            "simulated_s": round(self.simulated_s, 1),
            "processor_s": round(self.processor_s, 2),
        }


def run_case(
    case: Case,
    seed: int = 0,
    shots: Path | None = None,
    robot: RobotModel | None = None,
    estimate: Estimate | None = None,
    *,
    options: RunOptions = RUNS,
) -> Run:
    """Carry out one command.

    Args:
        case: the command and its scene.
        seed: of the simulation and of planning.
        shots: where pictures from outside go, one after each motion.
        robot: its model, if it was made before.
        estimate: an estimator of poses beside the robot, see stepped_robot.
        options: when the command counts as done.
    """
    began = time.process_time()
    simulator = Simulator(case.scene, seed * 1000 + case.number)
    try:
        count = iter(range(1000))

        def watch() -> None:
            if shots is not None:
                Image.fromarray(simulator.render_overview()).save(f"{shots}_{next(count):02d}.png")

        machine = SteppedRobot(simulator, watch if shots is not None else None, estimate)
        machine.observer = observer = ActObserver(simulator, case.meaning)
        start, before, first_s = machine.positions(), simulator.object_states(), simulator.time_s
        told: list[Status] = []
        task = task_of(case, machine.look(), before)
        engine = Engine(
            robot or RobotModel(tiago_urdf()), machine, ExecutionConfig(seed=seed + 1, planning_time_s=2.0), told.append
        )
        outcome = engine.execute(task)
        machine.rest(options.settle_steps)
        physical = _judge_run(case, before, simulator, observer)
        away = home_error(start, machine.positions())
        drift = float(np.linalg.norm(simulator.robot.base_matrix()[:2, 3]))
        contacts = simulator.contacts
        return Run(
            case,
            outcome,
            physical,
            tuple(told),
            contacts.forces,
            contacts.table,
            contacts.bystanders,
            away,
            drift,
            simulator.time_s - first_s,
            time.process_time() - began,
        )
    finally:
        simulator.close()


def _judge_run(
    case: Case, before: tuple[ObjectState, ...], simulator: Simulator, observer: ActObserver
) -> PhysicalResult:
    """Judge the end, and what was seen on the way to it."""
    table, states = case.scene.table, {state.id: state for state in before}
    result = judge(before, simulator.object_states(), case.meaning, table)
    objects = states[case.meaning.object], states[case.meaning.target] if case.meaning.target is not None else None
    held = simulator.contacts.between_fingers
    return judge_act(case.primitive, result, observer.moments, objects, held, table)


def task_of(case: Case, seen: Seen, states: Iterable[ObjectState]) -> ManipulationTask:
    """Ground a command: those of the objects seen are meant that lie where the states say."""
    places = {state.id: state.position[:2] for state in states}
    obj = _nearest(seen, places[case.meaning.object])
    target = case.meaning.target
    goal = None
    if target is not None and case.primitive in (Primitive.PUT_IN, Primitive.PUT_ON, Primitive.STACK, Primitive.POUR):
        goal = _nearest(seen, places[target])
    height = seen.table.height_m if seen.table is not None else case.scene.table.height
    pose = None if case.place is None else make_upright_pose(np.array([*case.place, height]), 0.0)
    said = case.scene.object(target).kind if target is not None else ""
    return ManipulationTask(
        f"case{case.number}", 0, case.primitive, "none", obj, seen.detections, seen.table, goal, pose, case.kind, said
    )


def home_error(start: Mapping[str, float], end: Mapping[str, float]) -> float:
    """Return how far the joint farthest from where it began is [rad or m], wheels and fingers left out."""
    return max(abs(end[name] - start[name]) for name in start if "wheel" not in name and "finger" not in name)


def _nearest(seen: Seen, xy: Any) -> Detection:
    return min(
        (d for d in seen.detections if d.geometry is not None),
        key=lambda d: float(np.linalg.norm(np.median(d.geometry.cloud[:, :2], axis=0) - xy)),  # type: ignore[union-attr]
    )


@functools.cache
def _robot_model() -> RobotModel:
    """Return the model of the robot, made once in a process."""
    return RobotModel(tiago_urdf())


def _seed_planner() -> None:
    """Let OMPL's global generator begin anew, as in a fresh process: motions of a case depend on that case alone."""
    level = ou.getLogLevel()
    ou.setLogLevel(ou.LOG_NONE)  # it warns of a seed that changes; planners made after this draw from it all the same
    ou.RNG.setSeed(1)
    ou.setLogLevel(level)


@dataclass(frozen=True, slots=True)
class CaseTask:
    """One case to be run by a worker process; shots is the folder for pictures from outside, None for none."""

    number: int
    seed: int
    shots: Path | None = None


def run_numbered_case(task: CaseTask, *, options: RunOptions = RUNS) -> dict[str, Any]:
    """Run one case in a worker process and return its JSON object, whatever the process has run before."""
    _seed_planner()
    shots = None if task.shots is None else task.shots / f"case{task.number:02d}"
    return run_case(make_case(task.number, task.seed), task.seed, shots, _robot_model(), options=options).as_dict()


def run_benchmark(
    numbers: Iterable[int],
    seed: int = 0,
    pool: PoolOptions = PoolOptions(),  # noqa: B008  (frozen)
    say: Callable[[str], None] = lambda _: None,
    shots: Path | None = None,
    *,
    options: RunOptions = RUNS,
) -> dict[str, Any]:
    """Run cases in worker processes and return the benchmark's JSON object; say is told of each run.

    Raises:
        WorkerError: the workers cannot be had, or died.
    """
    began = time.monotonic()
    details: list[dict[str, Any]] = []
    tasks = {
        f"case {number}": CaseTask(number, seed, None if shots is None else shots.absolute()) for number in numbers
    }
    with closing(TaskPool(pool, say).run(run_numbered_case, tasks)) as results:
        for detail in results:
            details.append(detail)
            say(in_words(detail))
    details.sort(key=lambda d: int(d["case"]))
    return {
        **summary(details, options=options),
        "seed": seed,
        "wall_s": round(time.monotonic() - began, 1),
        "runs_detail": details,
    }


def summary(details: list[dict[str, Any]], *, options: RunOptions = RUNS) -> dict[str, Any]:
    """Return the totals over runs."""
    moved = [d for d in details if d["others_moved_m"] > options.moved_m]
    return {
        "runs": len(details),
        "succeeded": sum(d["success"] for d in details),
        "table_contacts": sum(d["table_touches"] for d in details),
        "bystander_moved_share": round(len(moved) / max(len(details), 1), 4),
        "by_kind": _shares(details, "kind"),
        "by_relation": _shares(details, "relation"),
        "by_arm": _shares(details, "arm"),
        "planning_median_s": float(np.median([d["planning_s"][0] for d in details if d["planning_s"]] or [0.0])),
    }


def _shares(details: list[dict[str, Any]], key: str) -> dict[str, str]:
    """Return "succeeded/runs" for each value of a key."""
    values = sorted({d[key] for d in details})
    return {
        v: f"{sum(d['success'] for d in details if d[key] == v)}/{sum(d[key] == v for d in details)}" for v in values
    }


def in_words(detail: dict[str, Any]) -> str:
    """Return one line about a run."""
    mark = "ok " if detail["success"] else "BAD"
    target = f" {detail['target']}" if detail["target"] else ""
    text = f"{mark} case {detail['case']:2d}: {detail['relation']} {detail['kind']}{target} ({detail['arm']}, "
    text += f"{detail['clutter']} things, {detail['attempts']} tries): {detail['said']}"
    return text if detail["success"] else f"{text}; {detail['physics']}; table touched {detail['table_touches']} times"


def table(result: dict[str, Any]) -> str:
    """Return the totals as lines for people."""
    lines = [f"{result['succeeded']} of {result['runs']} commands ended as they should ({result['wall_s']:.0f} s)"]
    lines.append(f"touches of the table: {result['table_contacts']}")
    lines.append(f"runs that moved something else over 2 cm: {result['bystander_moved_share']:.1%}")
    lines += [
        ", ".join(f"{name or 'none'} {share}" for name, share in result[key].items())
        for key in ("by_relation", "by_kind", "by_arm")
    ]
    return "\n".join(lines)
