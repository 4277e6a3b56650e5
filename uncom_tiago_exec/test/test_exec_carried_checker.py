# SPDX-License-Identifier: Apache-2.0
"""A checker of carrying is of the grasp that it was asked for, even if that grasp lies where another one was."""

from types import SimpleNamespace

import numpy as np
from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning import arm_planner
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.types import Obstacle

TOUCHES = frozenset({"table"})


def planner(monkeypatch):
    """An arm planner whose checkers are the things that would hang in the hand."""
    monkeypatch.setattr(arm_planner, "CollisionChecker", lambda *args: args[-1])
    monkeypatch.setattr(arm_planner, "IkSolver", lambda *_: None)
    group = SimpleNamespace(velocity=[1.0] * 8, vector=lambda _: np.zeros(8))
    robot = SimpleNamespace(gripper=lambda _: SimpleNamespace(open=0.09), group=lambda *_: group)
    scene = SimpleNamespace(
        obstacles=lambda **_: (), moved_solids=(Obstacle("cup", "box", (0.1, 0.1, 0.1), np.eye(4)),)
    )
    return ArmPlanner(robot, "left", {}, scene, ExecutionConfig())


def grasp_at(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return Grasp(pose, 0.05, 0.08, 0.1, 1.0, "across")


def test_no_grasp_gets_the_checker_of_one_that_is_gone(monkeypatch):
    """Each grasp is dropped before the next is made, which may then have the same address."""
    arm = planner(monkeypatch)
    for k in range(50):
        held = arm.carry_checker(grasp_at(float(k)), TOUCHES)
        assert held.parts[0].pose[0, 3] == -float(k)


def test_a_grasp_keeps_its_checkers(monkeypatch):
    arm, grasp = planner(monkeypatch), grasp_at(0.3)
    first = arm.carry_checker(grasp, TOUCHES)
    other = arm.carry_checker(grasp, frozenset())
    assert other is not first
    assert arm.carry_checker(grasp, TOUCHES) is first
