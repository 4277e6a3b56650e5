# SPDX-License-Identifier: Apache-2.0
"""What is held by friction stays where it is between the pads, however long it is held."""

import numpy as np
import pybullet
import pytest
from uncom_common.primitive import Primitive
from uncom_common.transforms import invert
from uncom_sim.bench_execution.cases import Case
from uncom_sim.bench_execution.run import task_of
from uncom_sim.bench_execution.stepped_robot import SteppedRobot
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.types import Meaning, Scene, SceneObject
from uncom_sim.world.contact_counter import ContactCounter
from uncom_sim.world.simulator import Simulator
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.execution.engine import Engine
from uncom_tiago_exec.robot.robot_model import RobotModel

SECONDS = 8.0


def place_in_hand(simulator: Simulator, side: str) -> np.ndarray:
    """Return transform_thing_to_hand (4, 4)."""
    (state,) = simulator.object_states()
    return invert(simulator.robot.frame(f"gripper_{side}_grasping_frame")) @ state.pose


@pytest.mark.parametrize(("kind", "y"), [("cup", -0.25), ("can", 0.2), ("pear", -0.15)])
def test_a_thing_that_is_held_neither_slides_nor_turns(kind, y):
    scene = Scene((SceneObject("o0", kind, "red", 0.6, y, 0.4),), "take it")
    simulator = Simulator(scene, 3)
    try:
        machine = SteppedRobot(simulator)
        told = []
        engine = Engine(RobotModel(tiago_urdf()), machine, ExecutionConfig(seed=2), told.append)
        case = Case(0, scene, Meaning("o0", "none"), "pick", Primitive.PICK, None)
        outcome = engine.execute(task_of(case, machine.look(), simulator.object_states()))
        assert outcome.success, outcome.reason
        side = next(status.arm for status in reversed(told) if status.arm)
        machine.rest(60)
        before = place_in_hand(simulator, side)
        machine.rest(round(240 * SECONDS))
        after = place_in_hand(simulator, side)
        assert np.linalg.norm(after[:3, 3] - before[:3, 3]) < 0.001
        turn = np.arccos(np.clip((np.trace(before[:3, :3].T @ after[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))
        assert np.degrees(turn) < 1.0
    finally:
        simulator.close()


@pytest.mark.parametrize(("distance_m", "force_n", "held"), [(-1e-4, 9.0, 1), (5e-6, 9.0, 1), (5e-6, 0.0, 0)])
def test_what_presses_touches_though_the_engine_leaves_some_micrometres_between(monkeypatch, distance_m, force_n, held):
    """A mug hung between two pads, one of them 5 micrometres away with 16 N; what is only near is not held."""
    robot, thing = 1, 2
    one = (0, robot, thing, 13, -1, (), (), (), -1e-4, 9.0)
    other = (0, robot, thing, 14, -1, (), (), (), distance_m, force_n)
    monkeypatch.setattr(pybullet, "getContactPoints", lambda *_, **__: (one, other))
    counter = ContactCounter(0, robot, 3, {"mug": thing}, {13: 0, 14: 0})
    counter.update(1.0)
    assert len(counter.between_fingers) == held
