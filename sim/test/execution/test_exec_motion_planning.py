# SPDX-License-Identifier: Apache-2.0
"""Kinematics, collision checks, planning and timing on the real robot model."""

import numpy as np
import pytest
from exec_fixtures import TABLE_Z, robot, start_positions
from uncom_tiago_exec.collision.collision_checker import CollisionChecker, densify
from uncom_tiago_exec.exceptions import InCollisionError, PlanningError, RobotModelError, UnreachableError
from uncom_tiago_exec.kinematics.cartesian_path import straight_path
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.planning.joint_planner import JointPlanner
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.types import SIDES, Obstacle

TABLE = Obstacle("table", "box", (0.5, 1.0, 0.06), make_upright_pose(np.array([0.7, 0.0, TABLE_Z - 0.03]), 0.0))


def group(side="left"):
    return robot().group(side, start_positions())


def down(x, y, z, yaw=0.0):
    """A hand that points straight down."""
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1] = [0, 0, -1], [-np.sin(yaw), np.cos(yaw), 0]
    pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
    pose[:3, 3] = x, y, z
    return pose


def test_gripper_is_measured_from_its_shapes():
    """Stroke, finger length and thickness are those of PAL's gripper on both sides."""
    for side in SIDES:
        gripper = robot().gripper(side)
        assert gripper.open == pytest.approx(0.09, abs=0.002)
        assert 0.05 < gripper.tip < 0.15
        assert gripper.palm < 0.0
        assert gripper.thickness == pytest.approx(0.01, abs=0.005)


def test_a_description_that_is_no_tiago_is_refused():
    with pytest.raises(RobotModelError, match="cannot be used for planning"):
        RobotModel("<no urdf")
    with pytest.raises(RobotModelError, match="lacks joints"):
        RobotModel('<robot name="r"><link name="base_footprint"/></robot>')


@pytest.mark.parametrize("side", SIDES)
def test_ik_reaches_every_reachable_pose(side):
    """Each of 100 poses that some configuration has is reached within 1 mm and 0.01 rad, inside the limits."""
    arm = group(side)
    rng = np.random.default_rng(3)
    solver = IkSolver(arm, seed=4)
    for _ in range(100):
        target = arm.forward(rng.uniform(arm.lower, arm.upper))
        q = solver.solutions(target, [rng.uniform(arm.lower, arm.upper)], restarts=40)[0]
        error = np.linalg.inv(arm.forward(q)) @ target
        assert np.linalg.norm(error[:3, 3]) < 1e-3
        assert np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)) < 0.01
        assert (q >= arm.lower - 1e-9).all()
        assert (q <= arm.upper + 1e-9).all()


def test_ik_tells_unreachable_from_in_collision():
    arm = group()
    checker = CollisionChecker(arm, (TABLE,))
    solver = IkSolver(arm)
    with pytest.raises(UnreachableError, match="does not reach"):
        solver.solutions(down(1.6, 0.2, 1.0), [], checker)
    with pytest.raises(InCollisionError, match="table"):
        solver.solutions(down(0.55, 0.2, TABLE_Z + 0.06), [], checker)


def test_start_pose_is_free_and_a_hand_in_the_table_is_not():
    arm = group()
    checker = CollisionChecker(arm, (TABLE,))
    assert checker.is_free(arm.vector(start_positions()))
    inside = IkSolver(arm).solutions(down(0.55, 0.2, TABLE_Z + 0.05), [arm.vector(start_positions())])[0]
    assert not checker.is_free(inside)
    assert any("table" in pair for pair in checker.touching(inside))


def test_plans_are_free_on_recheck_and_end_where_asked():
    """Paths from tuck to above the table keep their margin at every 0.005 rad."""
    arm = group()
    box = Obstacle("box", "box", (0.1, 0.1, 0.25), make_upright_pose(np.array([0.6, 0.1, TABLE_Z + 0.125]), 0.3))
    checker = CollisionChecker(arm, (TABLE, box))
    start = arm.vector(start_positions())
    solver, planner = IkSolver(arm, 2), JointPlanner(checker)
    for x, y in ((0.55, 0.3), (0.5, 0.0), (0.6, 0.4)):
        goals = solver.solutions(down(x, y, TABLE_Z + 0.25), [start], checker, count=2)
        path = planner.plan(start, goals)
        assert np.allclose(path[0], start, atol=1e-3)
        assert any(np.allclose(path[-1], goal, atol=1e-6) for goal in goals)
        assert all(checker.is_free(q) for q in densify(path, 0.005))


def test_a_straight_line_is_straight():
    arm = group()
    checker = CollisionChecker(arm, (TABLE,))
    solver = IkSolver(arm)
    start = solver.solutions(down(0.55, 0.2, TABLE_Z + 0.3), [arm.vector(start_positions())], checker)[0]
    path = straight_path(solver, checker, start, down(0.55, 0.2, TABLE_Z + 0.15))
    for q in densify(path, 0.01):
        pose = arm.forward(q)
        assert np.linalg.norm(pose[:2, 3] - [0.55, 0.2]) < 0.003
        assert pose[2, 0] < -0.9999
    with pytest.raises((InCollisionError, PlanningError)):
        straight_path(solver, checker, start, down(0.55, 0.2, TABLE_Z + 0.02))
