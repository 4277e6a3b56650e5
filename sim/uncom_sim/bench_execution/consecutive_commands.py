# SPDX-License-Identifier: Apache-2.0
"""`uncom bench execution --in-a-row N`: one robot and one engine carry out command after command.

Looked for: memory that grows, a start pose that is reached less and less well, a state it does not come out of.
"""

from __future__ import annotations

import ctypes
import gc
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import psutil
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.base_frame import task_in_odom
from uncom_tiago_exec.types import Stage

from uncom_sim.bench_execution.command_generation import next_command, random_scene
from uncom_sim.bench_execution.options import RUNS, SEQUENCES, RunOptions, SequenceOptions
from uncom_sim.bench_execution.run import home_error, task_of
from uncom_sim.bench_execution.stepped_robot import SteppedRobot
from uncom_sim.exceptions import SceneError
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.scoring.end_state import judge
from uncom_sim.world.simulator import Simulator

_KINDS = ("can", "box", "cup", "bottle", "apple")


@dataclass(frozen=True, slots=True)
class CommandResult:
    """What came of one command: its words, whether it succeeded by physics, and how the robot stood afterwards.

    home_error is 0 while something is held; refused is whether nothing was moved; moved_m is of the bystander that
    moved farthest.
    """

    said: str
    success: bool
    home_error: float
    base_m: float
    rss_mb: float
    moved_m: float = 0.0
    refused: bool = False
    asked: str = ""


def run_consecutive_commands(
    count: int,
    seed: int = 0,
    say: Callable[[str], None] = lambda _: None,
    *,
    run_options: RunOptions = RUNS,
    sequence_options: SequenceOptions = SEQUENCES,
) -> dict[str, Any]:
    """Give commands one after the other and return the JSON object; say is told of each.

    "ended" says why there are fewer than were wanted, if so.

    Raises:
        SceneError: not even a first one could be drawn.
    """
    began, rng = time.monotonic(), np.random.default_rng([seed, 23])
    simulator = Simulator(random_scene(_KINDS, rng), seed)
    results: list[CommandResult] = []
    ended = ""
    try:
        machine = SteppedRobot(simulator)
        sequence = _CommandSequence(
            machine, Engine(RobotModel(tiago_urdf()), machine, ExecutionConfig(seed=seed + 1), lambda _: None)
        )
        for number in range(count):
            try:
                results.append(sequence.result(number, rng))
            except SceneError as error:  # what was measured so far is not lost
                ended = str(error)
                say(f"ended before command {number + 1}: {ended}")
                break
            say(f"{number + 1:3d} {'ok ' if results[-1].success else 'BAD'} {results[-1].asked}: {results[-1].said}")
        touches, bystanders = simulator.contacts.table, simulator.contacts.bystanders
    finally:
        simulator.close()
    if not results:
        raise SceneError(ended or "no command was wanted")
    return {
        **summarise_commands(results, run_options=run_options, sequence_options=sequence_options),
        "table_contacts": touches,
        "bystander_contacts": bystanders,
        "ended": ended,
        "seed": seed,
        "wall_s": round(time.monotonic() - began, 1),
    }


class _CommandSequence:
    """One robot that is given command after command."""

    def __init__(self, machine: SteppedRobot, engine: Engine) -> None:
        """The present joint positions are those that home_error is measured from."""
        self._machine = machine
        self._engine = engine
        self._start = machine.positions()
        self._held = ""  # id of the object in the hand

    def result(self, number: int, rng: np.random.Generator) -> CommandResult:
        """Give the next command, and judge what came of it."""
        machine, simulator = self._machine, self._machine.simulator
        before, scene = simulator.object_states(), simulator.world.scene
        case = next_command(number, before, scene, rng, self._held)
        outcome = self._engine.execute(task_in_odom(task_of(case, machine.look(), before), machine.base_pose()))
        machine.rest(SEQUENCES.settle_steps)
        physical = judge(before, simulator.object_states(), case.meaning, scene.table)
        self._held = case.meaning.object if outcome.in_hand else ""
        held_up = outcome.success and not physical.success
        return CommandResult(
            f"{outcome.reason} ({physical.reason})" if held_up else outcome.reason,
            outcome.success and physical.success,
            0.0 if self._held else home_error(self._start, machine.positions()),
            float(np.linalg.norm(simulator.robot.base_matrix()[:2, 3])),
            resident_mb(),
            physical.others_moved_m,
            not outcome.success and outcome.stage == Stage.PLANNING,
            f"{case.kind} {case.relation}",
        )


def summarise_commands(
    results: list[CommandResult], *, run_options: RunOptions = RUNS, sequence_options: SequenceOptions = SEQUENCES
) -> dict[str, Any]:
    """Return the totals: rss_growth_mb is from the end of the warm-up to the end, in_trouble the longest bad run."""
    longest = run = 0
    for result in results:
        run = 0 if result.success else run + 1
        longest = max(longest, run)
    warm = results[min(sequence_options.warm_up_commands, len(results)) - 1]
    return {
        "commands": len(results),
        "succeeded": sum(result.success for result in results),
        "refused": sum(result.refused for result in results),
        "in_trouble": longest,
        "bystanders_moved": sum(result.moved_m > run_options.moved_m for result in results),
        "home_error_max": round(max(result.home_error for result in results), 4),
        "home_error_last": round(results[-1].home_error, 4),
        "base_drift_m": round(results[-1].base_m, 4),
        "base_drift_max_m": round(max(result.base_m for result in results), 4),
        "rss_warm_mb": round(warm.rss_mb, 1),
        "rss_growth_mb": round(results[-1].rss_mb - warm.rss_mb, 1),
        "failures": [
            f"{i + 1} {result.asked}: {result.said}" for i, result in enumerate(results) if not result.success
        ],
    }


def table(result: dict[str, Any]) -> str:
    """Return the totals as lines for people."""
    trouble, touches, moved = result["in_trouble"], result["table_contacts"], result["bystanders_moved"]
    most, last, base = result["home_error_max"], result["home_error_last"], result["base_drift_m"]
    return "\n".join(
        (
            f"{result['succeeded']} of {result['commands']} commands ended as they should; {result['refused']} refused",
            f"most failures in a row: {trouble}; touches of the table: {touches}; something else was moved: {moved}",
            f"from the start pose at most {most}, at the end {last}; base {base} m away",
            f"memory: {result['rss_warm_mb']:.0f} MB warm, {result['rss_growth_mb']:+.1f} MB since",
            *result["failures"],
            *([f"ended early: {result['ended']}"] if result["ended"] else []),
        )
    )


def resident_mb() -> float:
    """Return the memory this process needs now [MB]: what lies free in its heap is given back to the system before."""
    gc.collect()
    with suppress(AttributeError):  # glibc has it, other C libraries do not
        ctypes.CDLL(None).malloc_trim(0)
    return float(psutil.Process().memory_info().rss) / 1e6
