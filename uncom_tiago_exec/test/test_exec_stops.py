# SPDX-License-Identifier: Apache-2.0
"""Stopped at any moment of any stage, the robot stands still at once and the next command is carried out."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from exec_fixtures import robot
from uncom_sim.bench_execution import home_error, task_of
from uncom_sim.bench_execution_cases import Case
from uncom_sim.bench_robot import SteppedRobot
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.simulator import Simulator
from uncom_sim.types import Meaning, Scene, SceneObject
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.engine import Engine
from uncom_tiago_exec.types import Stage

STILL_S = 0.2
STAGES = (
    Stage.APPROACHING,
    Stage.GRASPING,
    Stage.LIFTING,
    Stage.TRANSFERRING,
    Stage.PLACING,
    Stage.RETREATING,
    Stage.HOMING,
)


class Interrupter:
    """Stops the robot somewhere within the stage that is wanted next; counts in which stages it was stopped."""

    def __init__(self, machine, seed):
        self.machine = machine
        self.rng = np.random.default_rng(seed)
        self.wanted = None
        self.stopped = Counter()
        self.driven = 0
        self.driving = False

    def report(self, status):
        self.driving = "driving" in status.detail
        if status.stage == self.wanted and self.machine.stop_at_s is None and self.rng.random() < 0.5:
            within_s = float(status.data.get("duration_s", 0.6))
            self.machine.stop_at_s = self.machine.simulator.time_s + float(self.rng.uniform(0.0, within_s))

    def count(self, outcome):
        self.stopped[outcome.stage] += 1
        self.driven += self.driving
        self.machine.stop_at_s = None


def assert_still(machine):
    """0.2 s after a stop nothing moves any more, and nothing moves later."""
    simulator = machine.simulator
    machine.rest(round(STILL_S * 240))
    assert np.abs(simulator.robot.readings.velocity).max() < 0.05
    assert abs(simulator.base.odometry.linear) < 0.01
    here, place = machine.positions(), simulator.base.odometry.x
    machine.rest(48)
    later = machine.positions()
    assert max(abs(later[n] - here[n]) for n in here) < 0.01
    assert abs(simulator.base.odometry.x - place) < 0.002


def grounded(case, machine):
    """Return the command as it is seen from where the base is now, or None where the arm hides everything."""
    shift = np.eye(4)
    shift[0, 3] = -machine.simulator.base.odometry.x
    states = [replace(state, pose=shift @ state.pose) for state in machine.simulator.object_states()]
    seen = machine.look()
    if not seen.detections:
        return None
    return task_of(replace(case, place=(case.place[0] + shift[0, 3], case.place[1])), seen, states)


def stop_and_go(case, stops, seed):
    """Give one command after the other, each stopped somewhere or not at all, until there were so many stops."""
    simulator = Simulator(case.scene, seed)
    machine = SteppedRobot(simulator)
    interrupter = Interrupter(machine, seed)
    start = machine.positions()
    engine = Engine(robot(), machine, ExecutionConfig(verify=False), interrupter.report)
    try:
        last = grounded(case, machine)
        for command in range(2 * stops + 10):
            if interrupter.stopped.total() >= stops:
                break
            interrupter.wanted = STAGES[command % len(STAGES)]
            task = grounded(case, machine)
            if task is None:  # whatever it is told, it goes home first
                engine.execute(replace(last, primitive="wave"))
                task = grounded(case, machine)
            last = task
            outcome = engine.execute(task)
            if outcome.reason == "stopped on request":
                interrupter.count(outcome)
                assert_still(machine)
            else:  # where it is already is no place to put it, and that is said
                machine.stop_at_s = None
                assert outcome.success or outcome.stage == Stage.PLANNING, outcome.reason
        interrupter.wanted = None
        assert interrupter.stopped.total() == stops
        assert any(engine.execute(grounded(case, machine)).success for _ in range(3))
        assert home_error(start, machine.positions()) < 0.03
        assert abs(simulator.base.odometry.x) < 0.02
        assert simulator.contacts.table == 0
        return interrupter
    finally:
        simulator.close()


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.xfail(reason="has not passed to its end yet: commands are refused once the thing is at its place")
def test_a_stop_at_any_of_forty_moments_of_all_stages_leaves_it_still_and_usable():
    things = (
        SceneObject("o0", "box", natural_colour("box"), 0.58, 0.22, 0.3),
        SceneObject("o1", "can", natural_colour("can"), 0.62, -0.25, 0.0),
    )
    case = Case(0, Scene(things, "do it"), Meaning("o0", "area", None, (0.58, 0.02)), "area", "place", (0.58, 0.02))
    stopped = stop_and_go(case, 40, 0).stopped
    assert set(STAGES) <= set(stopped), stopped


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.xfail(reason="has not passed to its end yet: commands are refused once the thing is at its place")
def test_a_stop_while_base_or_arm_are_on_their_way_to_what_is_far_leaves_it_still_and_usable():
    """Ten moments: both places are too far for the arms, so the base drives nearer and back."""
    things = (
        SceneObject("o0", "can", natural_colour("can"), 0.84, 0.2, 0.0),
        SceneObject("o1", "box", natural_colour("box"), 0.6, -0.3, 0.0),
    )
    case = Case(0, Scene(things, "do it"), Meaning("o0", "area", None, (0.84, 0.0)), "area", "place", (0.84, 0.0))
    interrupter = stop_and_go(case, 10, 1)
    assert interrupter.driven > 0
