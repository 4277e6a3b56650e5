# SPDX-License-Identifier: Apache-2.0
"""Stopped at any moment, the robot stands still at once and can be used again."""

import numpy as np
import pytest
from exec_fixtures import robot
from uncom_sim.bench_execution import home_error, task_of
from uncom_sim.bench_execution_cases import make_case
from uncom_sim.bench_robot import SteppedRobot
from uncom_sim.simulator import Simulator
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.engine import Engine
from uncom_tiago_exec.types import Stage

STILL_S = 0.2
MOMENTS = 50


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_a_stop_at_any_of_fifty_moments_leaves_it_still_and_usable():
    rng = np.random.default_rng(0)
    case = make_case(3, 1)
    simulator = Simulator(case.scene, 0)
    machine = SteppedRobot(simulator)
    task = task_of(case, machine.look(), simulator.object_states())
    start = machine.positions()
    engine = Engine(robot(), machine, ExecutionConfig(verify=False), lambda _: None)
    try:
        for _ in range(MOMENTS):
            machine.stop_at_s = simulator.time_s + float(rng.uniform(0.1, 14.0))
            outcome = engine.execute(task)
            if outcome.reason == "stopped on request":
                machine.stop_at_s = None
                machine.rest(round(STILL_S * 240))
                speeds = simulator.robot.readings.velocity
                assert np.abs(speeds).max() < 0.05
                here = machine.positions()
                machine.rest(48)
                later = machine.positions()
                assert max(abs(later[n] - here[n]) for n in here) < 0.01
            if engine.execute(task).stage != Stage.DONE:  # the thing may lie elsewhere now: look where it is
                task = task_of(case, machine.look(), simulator.object_states())
        machine.stop_at_s = None
        engine.execute(task)
        assert home_error(start, machine.positions()) < 0.03
        assert simulator.contacts.table == 0
    finally:
        simulator.close()
