# SPDX-License-Identifier: Apache-2.0
"""`uncom bench execution --in-a-row N`: one robot and one engine carry out command after command.

Looked for: memory that grows, a start pose that is reached less and less well, a state it does not come out of.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import psutil
import shapely
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.engine import Engine
from uncom_tiago_exec.robot_model import RobotModel

from uncom_sim.bench_execution import home_error, task_of
from uncom_sim.bench_execution_cases import Case
from uncom_sim.bench_robot import SteppedRobot
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.objects.footprint import outline
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.scoring import judge
from uncom_sim.simulator import Simulator
from uncom_sim.types import Meaning, Point2, Scene, SceneObject

_KINDS = ("can", "box", "cup", "bottle")
_WARM = 10  # commands before memory is looked at
_X, _Y = (0.50, 0.66), (-0.3, 0.3)
_CLEAR_M = 0.09  # between outlines
_SETTLE_STEPS = 120
_MB = 1e6


@dataclass(frozen=True, slots=True)
class Turn:
    """What came of one command: its words, whether it succeeded by physics, and how the robot stood afterwards."""

    said: str
    success: bool
    home_error: float
    base_m: float
    rss_mb: float


def run_in_a_row(count: int, seed: int = 0, say: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Give commands one after the other and return the JSON object; say is told of each."""
    began, rng = time.monotonic(), np.random.default_rng([seed, 23])
    scene = _scene(rng)
    simulator = Simulator(scene, seed)
    turns: list[Turn] = []
    try:
        machine = SteppedRobot(simulator)
        start = machine.positions()
        engine = Engine(RobotModel(tiago_urdf()), machine, ExecutionConfig(seed=seed + 1), lambda _: None)
        for number in range(count):
            case = _next_case(number, simulator, scene, rng)
            before = simulator.object_states()
            outcome = engine.execute(task_of(case, machine.look(), before))
            machine.rest(_SETTLE_STEPS)
            physical = judge(before, simulator.object_states(), case.meaning, scene.table)
            turns.append(
                Turn(
                    outcome.reason,
                    outcome.success and physical.success,
                    home_error(start, machine.positions()),
                    abs(simulator.base.odometry.x),
                    resident_mb(),
                )
            )
            say(f"{number + 1:3d} {'ok ' if turns[-1].success else 'BAD'} {case.kind}: {outcome.reason}")
        touches = simulator.contacts.table
    finally:
        simulator.close()
    return {
        **summary_in_a_row(turns),
        "table_contacts": touches,
        "seed": seed,
        "wall_s": round(time.monotonic() - began, 1),
    }


def summary_in_a_row(turns: list[Turn]) -> dict[str, Any]:
    """Return the totals: rss_growth_mb is from the end of the warm-up to the end, in_trouble the longest bad run."""
    longest = run = 0
    for turn in turns:
        run = 0 if turn.success else run + 1
        longest = max(longest, run)
    warm = turns[min(_WARM, len(turns) - 1)]
    return {
        "commands": len(turns),
        "succeeded": sum(turn.success for turn in turns),
        "in_trouble": longest,
        "home_error_max": round(max(turn.home_error for turn in turns), 4),
        "home_error_last": round(turns[-1].home_error, 4),
        "base_drift_m": round(turns[-1].base_m, 4),
        "rss_warm_mb": round(warm.rss_mb, 1),
        "rss_growth_mb": round(turns[-1].rss_mb - warm.rss_mb, 1),
        "failures": [turn.said for turn in turns if not turn.success],
    }


def table(result: dict[str, Any]) -> str:
    """Return the totals as lines for people."""
    return "\n".join(
        (
            f"{result['succeeded']} of {result['commands']} commands ended as they should",
            f"most failures in a row: {result['in_trouble']}; touches of the table: {result['table_contacts']}",
            f"from the start pose at most {result['home_error_max']}, at the end {result['home_error_last']}",
            f"memory: {result['rss_warm_mb']:.0f} MB warm, {result['rss_growth_mb']:+.1f} MB since",
        )
    )


def resident_mb() -> float:
    """Return the memory this process holds now [MB]."""
    return float(psutil.Process().memory_info().rss) / _MB


def _scene(rng: np.random.Generator) -> Scene:
    placed: list[SceneObject] = []
    for i, kind in enumerate(_KINDS):
        x, y = _free_place(placed, SceneObject(f"o{i}", kind, natural_colour(kind), 0.0, 0.0, 0.0), rng)
        placed.append(SceneObject(f"o{i}", kind, natural_colour(kind), x, y, 0.0))
    return Scene(tuple(placed), "do it")


def _free_place(others: list[SceneObject], thing: SceneObject, rng: np.random.Generator) -> Point2:
    for _ in range(500):
        x, y = float(rng.uniform(*_X)), float(rng.uniform(*_Y))
        moved = outline(SceneObject(thing.id, thing.kind, thing.colour, x, y, thing.yaw))
        apart = all(moved.distance(outline(other)) > _CLEAR_M for other in others)
        if apart and np.hypot(x - thing.x, y - thing.y) > 0.13:
            return x, y
    raise SceneError("no free place was found on the table")


def _next_case(number: int, simulator: Simulator, scene: Scene, rng: np.random.Generator) -> Case:
    """Return a command to bring one of the things that stand within reach to a free place on its side."""
    now = [
        SceneObject(s.id, s.kind, s.colour, float(s.position[0]), float(s.position[1]), _yaw(s.pose))
        for s in simulator.object_states()
    ]
    reach = shapely.box(_X[0] - 0.04, _Y[0] - 0.08, _X[1] + 0.08, _Y[1] + 0.08)
    near = [thing for thing in now if reach.contains(shapely.Point(thing.x, thing.y))]
    if not near:
        raise SceneError("everything has left the part of the table that the arms reach")
    thing = near[int(rng.integers(len(near)))]
    place = _free_place([other for other in now if other.id != thing.id], thing, rng)
    return Case(number, scene, Meaning(thing.id, "area", None, place), "area", "place", place)


def _yaw(pose: Any) -> float:
    return float(np.arctan2(pose[1, 0], pose[0, 0]))
