# SPDX-License-Identifier: Apache-2.0
"""A collision-free motion over a cluttered table, timed with limits of velocity, acceleration and jerk.

Run it with: ./uncom exec python examples/02_plan_a_motion.py
"""

import numpy as np
from uncom_sim.bench_planning.scenes import tabletop_solids
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import home_positions
from uncom_tiago_exec.collision.collision_checker import CollisionChecker
from uncom_tiago_exec.kinematics.ik_solver import IkSolver
from uncom_tiago_exec.planning.joint_planner import JointPlanner
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.trajectory.time_parameterization import MotionLimits, time_path

robot = RobotModel(tiago_urdf())
positions = home_positions(0.35, (0.0, -0.95), 0.02)
group = robot.group("left", positions)
checker = CollisionChecker(group, tabletop_solids(np.random.default_rng(4), count=4))

above_table = np.eye(4)
above_table[:3, :3] = np.column_stack([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
above_table[:3, 3] = 0.6, 0.2, 1.0
start = group.vector(positions)
goals = IkSolver(group, seed=0).solutions(above_table, [start], checker, count=3)

path = JointPlanner(checker).plan(start, goals)
limits = MotionLimits(
    velocity=0.8 * group.velocity,  # [m/s] of the torso, [rad/s] of the arm
    acceleration=np.array([0.25] + [3.0] * 7),  # [m/s^2], [rad/s^2]
    jerk_ratio=12.0,  # jerk over acceleration [1/s]
)
trajectory = time_path(group.joint_names, path, limits, radius=0.1)
print(f"{len(path)} waypoints, {len(trajectory.times)} points in {trajectory.times[-1]:.2f} s")
print("free at every point:", checker.path_is_free(group.clamp(trajectory.positions)))
