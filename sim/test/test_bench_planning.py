# SPDX-License-Identifier: Apache-2.0
"""The planning benchmark: problems are fair, and peers get the same ones."""

import re

import numpy as np
import pinocchio as pin
import pytest
from uncom_sim.bench_planning import peer_roboplan as bench_planning_roboplan
from uncom_sim.bench_planning import run as bench_planning
from uncom_sim.bench_planning.peer_mplib import PYTHON
from uncom_sim.bench_planning.peers import ratios, run_peers
from uncom_sim.bench_planning.problems import locked_urdf
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.robot.joint_names import group_joints
from uncom_tiago_exec.robot.robot_model import RobotModel


@pytest.fixture(scope="module")
def robot():
    return RobotModel(tiago_urdf())


@pytest.fixture(scope="module")
def start():
    return home_positions(0.35, (0.2, -0.95), 0.02)


def test_a_locked_description_moves_the_hand_as_our_own_group_does(robot, start):
    group = robot.group("right", start)
    model = pin.buildModelFromXML(locked_urdf(tiago_urdf(), group_joints("right"), start))
    data = model.createData()
    hand = model.getFrameId("gripper_right_grasping_frame")
    assert list(model.names)[1:] == list(group_joints("right"))
    for q in np.random.default_rng(3).uniform(group.lower, group.upper, (20, 8)):
        pin.framesForwardKinematics(model, data, q)
        assert np.allclose(np.array(data.oMf[hand].homogeneous), group.forward(q), atol=1e-9)


def test_wheels_have_no_collision_shapes_in_a_locked_description(start):
    text = locked_urdf(tiago_urdf(), group_joints("left"), start)
    for link in re.findall(r'<link name="[^"]*wheel[^"]*".*?</link>', text, re.DOTALL):
        assert "<collision" not in link
    assert "<collision" in text


def test_problems_have_no_straight_way_and_free_ends(robot, start):
    for checker, home, goal, solids in bench_planning.single_problems(robot, start, 2, 5):
        assert 7 <= len(solids) <= 13
        assert checker.is_free(home)
        assert checker.is_free(goal)
        assert not checker.path_is_free(np.vstack([home, goal]))


def test_ratios_leave_out_peers_that_are_not_there():
    own = {"ik": {"median_ms": 0.4}, "check_us": 15.0, "plan": {"median_ms": 12.0}}
    there = {"ik": {"median_ms": 0.8}, "check_us": 30.0, "plan": {"median_ms": 6.0}}
    assert ratios(own, {"one": there, "other": "not installed"}) == {"one": {"ik": 0.5, "check": 0.5, "plan": 2.0}}


def test_a_peer_that_is_not_installed_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr(bench_planning_roboplan.importlib.util, "find_spec", lambda _: None)
    monkeypatch.delenv(PYTHON, raising=False)
    found = run_peers([], lambda *_: False, [], (None, []), {})
    assert "./uncom setup" in found["roboplan"]
    assert "./uncom setup --peers" in found["mplib"]


def test_a_peer_solves_poses_and_plans_of_ours(robot, start, monkeypatch):
    pytest.importorskip("roboplan.rrt")
    monkeypatch.delenv(PYTHON, raising=False)
    problems = list(bench_planning.single_problems(robot, start, 1, 5))
    found = bench_planning.peers(robot, start, problems, 4, 5)["roboplan"]
    assert found["ik"]["success"] == 1.0
    assert found["plan"]["success"] == 1.0


def test_the_time_in_motion_of_whole_plans_is_told_by_stage(robot, start):
    whole = bench_planning.whole_plans(robot, start, 3, 5)
    stages = whole["motion_by_stage"]
    assert {"approaching", "lifting", "transferring", "placing", "retreating", "homing"} <= set(stages)
    assert all(spent["over_bound"] >= 1.0 for spent in stages.values())
    assert 1.0 <= whole["motion_over_bound"] < 2.0
    assert whole["success"] == 1.0
