# SPDX-License-Identifier: Apache-2.0
"""The friction of a gripper's spindles holds both fingers where they are, until more than it pushes them aside."""

import numpy as np
import pybullet
import pytest
from uncom_sim.robot.joint_names import FINGERS
from uncom_sim.robot.options import FINGER_FRICTION
from uncom_sim.robot.robot import Robot, RobotOptions


def pushed_aside(push_n: float, seconds: float = 4.0) -> list[float]:
    """Push each finger of the left hand, their motors off, to one side; return how far they are aside [m]."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        robot = Robot(client, RobotOptions(finger=0.02))
        links = [robot.links[joint.replace("_joint", "_link")] for joint in FINGERS["left"]]
        push = (push_n * robot.frame("gripper_left_grasping_frame")[:3, 1]).tolist()
        aside = []
        for _ in range(int(240 * seconds)):
            robot.apply()
            for link in links:
                pybullet.setJointMotorControl2(
                    robot.body, link, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client
                )
                at = pybullet.getLinkState(robot.body, link, physicsClientId=client)[0]
                pybullet.applyExternalForce(robot.body, link, push, at, pybullet.WORLD_FRAME, physicsClientId=client)
            pybullet.stepSimulation(physicsClientId=client)
            robot.update()
            first, second = (robot.positions()[joint] for joint in FINGERS["left"])
            aside.append(abs(second - first) / 2.0)
        return aside
    finally:
        pybullet.disconnect(client)


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_push_below_the_friction_moves_nothing_however_long_it_lasts(share):
    aside = pushed_aside(share * FINGER_FRICTION.friction_n)
    assert aside[-1] < 0.001
    assert aside[-1] == pytest.approx(np.median(aside), abs=1e-4)


def test_a_push_above_it_moves_the_fingers_and_they_stay_where_it_left_them():
    assert pushed_aside(2.0 * FINGER_FRICTION.friction_n, 0.5)[-1] > 0.01
