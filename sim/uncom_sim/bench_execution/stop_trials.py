# SPDX-License-Identifier: Apache-2.0
"""`uncom bench execution --stops N`: one robot is stopped at N random moments of its commands.

Each time it must stand still within 0.2 s of simulated time, and the next command must be carried out.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from uncom_common.primitive import Primitive
from uncom_common.transforms import apply, invert
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.observation.detection_geometry import footprint_centre
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.base_frame import task_in_odom
from uncom_tiago_exec.types import ManipulationTask, Outcome, Stage, Status

from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.command_generation import WorkArea, next_command, random_scene
from uncom_sim.bench_execution.options import SEQUENCES, STOPS, StopOptions
from uncom_sim.bench_execution.run import home_error, task_of
from uncom_sim.bench_execution.stepped_robot import SteppedRobot
from uncom_sim.exceptions import SceneError
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.robot import TIME_STEP_S
from uncom_sim.scoring.end_state import judge
from uncom_sim.types import Scene
from uncom_sim.world.simulator import Simulator

STAGES = (
    Stage.APPROACHING,
    Stage.GRASPING,
    Stage.LIFTING,
    Stage.TRANSFERRING,
    Stage.PLACING,
    Stage.RETREATING,
    Stage.HOMING,
)
_KINDS = ("can", "box", "cup", "bottle")


@dataclass(frozen=True, slots=True)
class StopResult:
    """One stop: in which stage, driving or not, and what came of the commands after it until one succeeded.

    speed is how fast the fastest joint [rad/s, m/s] or the base still was, moved how far anything went after that.
    """

    stage: Stage
    driving: bool
    speed: float
    moved: float
    after: tuple[tuple[bool, str], ...] = ()

    @property
    def still(self) -> bool:
        """Whether nothing went anywhere any more; an arm that was stopped at full speed may still settle a little."""
        return self.speed < STOPS.settling_speed and self.moved < STOPS.still


class StopTrial:
    """One robot that is given commands and stopped at random moments of them."""

    def __init__(self, scene: Scene, seed: int, area: WorkArea | None = None, *, options: StopOptions = STOPS) -> None:
        """Simulate a robot before a scene; area is where objects are put, None for the default part of the table."""
        self._options = options
        self._part = area
        self.simulator = Simulator(scene, seed)
        self.machine = SteppedRobot(self.simulator)
        self.start = self.machine.positions()
        self.rng = np.random.default_rng([seed, 29])
        self._engine = Engine(RobotModel(tiago_urdf()), self.machine, ExecutionConfig(seed=seed + 1), self._report)
        self._wanted: Stage | None = None
        self._driving = False
        self._held = ""
        self._number = 0
        self._last: ManipulationTask | None = None

    def stop(self, wanted: Stage) -> StopResult | None:
        """Give a command and stop it in a stage, or shortly after; None if it came to its end before."""
        self._wanted = wanted
        outcome, _ = self._command()
        self._wanted = self.machine.stop_at_s = None
        if outcome.reason != "stopped on request":
            return None
        stage, driving = outcome.stage, self._driving
        speed, moved = self._residual_motion()
        after: list[tuple[bool, str]] = []
        while len(after) < self._options.tries and not (after and after[-1][0]):
            outcome, said = self._command()
            after.append((outcome.success, said))
        return StopResult(stage, driving, speed, moved, tuple(after))

    def _report(self, status: Status) -> None:
        self._driving = "driving" in status.detail
        if self._wanted is None or self.machine.stop_at_s is not None or status.stage < self._wanted:
            return
        if status.stage > self._wanted or self.rng.random() < self._options.stop_share:
            within_s = float(status.data.get("duration_s", self._options.finger_motion_s))  # type: ignore[arg-type]
            self.machine.stop_at_s = self.simulator.time_s + float(self.rng.uniform(0.0, within_s))

    def _command(self) -> tuple[Outcome, str]:
        """Give the next command; return what came of it, by physics too, and what is said of it."""
        before = self.simulator.object_states()
        case = next_command(self._number, before, self.simulator.world.scene, self.rng, self._held, self._part)
        self._number += 1
        outcome = self._engine.execute(self._perceived_task(case))
        self._held = case.meaning.object if outcome.in_hand else ""
        said = f"{case.kind} {case.relation}: {outcome.reason}"
        if outcome.success:
            self.machine.rest(SEQUENCES.settle_steps)
            physical = judge(before, self.simulator.object_states(), case.meaning, self.simulator.world.scene.table)
            if not physical.success:
                return replace(outcome, success=False), f"{said} ({physical.reason})"
        return outcome, said

    def _perceived_task(self, case: Case) -> ManipulationTask:
        """Return the command as it is seen; where the arm hides what is meant, the robot is first sent home.

        Raises:
            SceneError: it is not seen then either.
        """
        task = self._grounded_task(case)
        if task is None and self._last is not None:  # what it cannot do it refuses, once it has gone home
            self._engine.execute(replace(self._last, primitive=Primitive.NONE))
            task = self._grounded_task(case)
        if task is None:
            raise SceneError(f"the {case.kind} is not seen")
        self._last = task
        return task

    def _grounded_task(self, case: Case) -> ManipulationTask | None:
        """Return the command as it is seen from where the base is now, in odom; None if it is neither seen nor held."""
        base = self.machine.base_pose()
        to_base = invert(base.transform_base_to_odom)
        states = [replace(state, pose=to_base @ state.pose) for state in self.simulator.object_states()]
        place = None if case.place is None else apply(to_base, [*case.place, 0.0])
        seen = self.machine.look()
        if not any(obj.geometry is not None for obj in seen.detections):
            return None
        case = case if place is None else replace(case, place=(float(place[0]), float(place[1])))
        task = task_of(case, seen, states)
        there = next(state.position[:2] for state in states if state.id == case.meaning.object)
        away = float(np.linalg.norm(footprint_centre(task.object) - there))
        return task_in_odom(task, base) if self._held or away < self._options.seen_m else None

    def _residual_motion(self) -> tuple[float, float]:
        """Return the greatest speed 0.2 s after a stop, and how far anything moves after that."""
        self.machine.rest(round(self._options.still_s / TIME_STEP_S))
        base = self.simulator.base
        speed = max(float(np.abs(self.simulator.robot.readings.velocity).max()), 5.0 * abs(base.odometry.linear))
        here, place = self.machine.positions(), base.odometry.x
        self.machine.rest(self._options.later_steps)
        later = self.machine.positions()
        moved = max(abs(later[name] - here[name]) for name in here)
        return speed, max(moved, 5.0 * abs(base.odometry.x - place))


def run_stops(
    count: int,
    seed: int = 0,
    say: Callable[[str], None] = lambda _: None,
    scene: Scene | None = None,
    area: WorkArea | None = None,
    *,
    options: StopOptions = STOPS,
) -> dict[str, Any]:
    """Stop a robot so many times and return the JSON object; say is told of each stop.

    Without a scene a few objects stand about; area is where on the table objects are to be put.
    """
    began = time.monotonic()
    scene = scene or random_scene(_KINDS, np.random.default_rng([seed, 31]))
    robot, fruitless = StopTrial(scene, seed, area), 0
    stops: list[StopResult] = []
    ended = ""
    try:
        while len(stops) < count and fruitless < options.fruitless:
            try:
                done = robot.stop(STAGES[(len(stops) + fruitless) % len(STAGES)])
            except SceneError as error:  # what was measured so far is not lost
                ended = str(error)
                say(f"ended before stop {len(stops) + 1}: {ended}")
                break
            fruitless = fruitless + 1 if done is None else 0
            if done is not None:
                stops.append(done)
                last = done.after[-1]
                say(f"{len(stops):3d} {done.stage.name.lower()}: {'then' if last[0] else 'BAD'} {last[1]}")
        away = home_error(robot.start, robot.machine.positions())
        base_m = float(np.linalg.norm(robot.simulator.robot.base_matrix()[:2, 3]))
        touches = robot.simulator.contacts.table
    finally:
        robot.simulator.close()
    return {
        **summary_of_stops(stops),
        "home_error": round(away, 4),
        "base_drift_m": round(base_m, 4),
        "table_contacts": touches,
        "ended": ended,
        "seed": seed,
        "wall_s": round(time.monotonic() - began, 1),
    }


def summary_of_stops(stops: list[StopResult]) -> dict[str, Any]:
    """Return the totals: next_succeeded is of the very next command, usable of one of the next three."""
    return {
        "stops": len(stops),
        "still": sum(stop.still for stop in stops),
        "next_succeeded": sum(stop.after[0][0] for stop in stops),
        "usable": sum(stop.after[-1][0] for stop in stops),
        "stages": dict(Counter(stop.stage.name for stop in stops)),
        "driving": sum(stop.driving for stop in stops),
        "failures": [f"{stop.stage.name.lower()}: {said}" for stop in stops for good, said in stop.after if not good],
    }


def table(result: dict[str, Any], *, options: StopOptions = STOPS) -> str:
    """Return the totals as lines for people."""
    return "\n".join(
        (
            f"{result['stops']} stops: still within {options.still_s} s {result['still']} times",
            f"the next command succeeded {result['next_succeeded']} times, one of the next three {result['usable']}",
            f"stages: {', '.join(f'{name.lower()} {n}' for name, n in result['stages'].items())}",
            f"touches of the table: {result['table_contacts']}; base {result['base_drift_m']} m away at the end",
            *result["failures"],
            *([f"ended early: {result['ended']}"] if result["ended"] else []),
        )
    )
