# SPDX-License-Identifier: Apache-2.0
"""Grasps of an object of which one side was seen, best first.

Run it with: ./uncom exec python examples/03_grasp_candidates.py
"""

import numpy as np
from uncom_sim.robot.description import tiago_urdf
from uncom_tiago_exec.grasping.grasps import grasp_candidates
from uncom_tiago_exec.robot.robot_model import RobotModel
from uncom_tiago_exec.scene.object_shape import complete_shape

TABLE_Z = 0.72  # [m]

# The visible half of a can of 6 cm, standing at (0.6, 0.1) on the table, with 1 mm of noise.
rng = np.random.default_rng(0)
angle, height = rng.uniform(np.pi / 2, 3 * np.pi / 2, 3000), rng.uniform(0.0, 0.11, 3000)
cloud = np.column_stack([0.6 + 0.03 * np.cos(angle), 0.1 + 0.03 * np.sin(angle), TABLE_Z + height])
cloud += rng.normal(scale=0.001, size=cloud.shape)

shape = complete_shape("can", cloud, TABLE_Z)
print(f"completed: {shape.size.round(3)} m, bottom {shape.bottom:.3f} m, top {shape.top:.3f} m")
gripper = RobotModel(tiago_urdf()).gripper("left")
for grasp in grasp_candidates(shape, np.zeros((0, 3)), gripper)[:5]:
    at, along = grasp.pose[:3, 3].round(3), grasp.approach.round(2)
    print(f"quality {grasp.quality:.2f}  {grasp.family:7}  at {at} m  along {along}  open {grasp.opening:.3f} m")
