# SPDX-License-Identifier: Apache-2.0
"""The TIAGo++ that is simulated has the robot's frames, limits and grippers."""

from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from uncom_sim.robot.description import package_directory, tiago_urdf

HOME = (-1.1, 1.4679, 2.714, 1.7095, -1.5708, 1.3898, 0.0)


@pytest.fixture(scope="module")
def model():
    return pin.buildModelFromXML(tiago_urdf())


def _frame(model, joints, name):
    q = pin.neutral(model)
    for joint, value in joints.items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(name)].homogeneous


def _home(torso=0.15):
    joints = {f"arm_{side}_{i + 1}_joint": value for side in ("left", "right") for i, value in enumerate(HOME)}
    return {**joints, "torso_lift_joint": torso}


def test_meshes_resolve_for_pinocchio(model):
    for kind in (pin.COLLISION, pin.VISUAL):
        geometry = pin.buildGeomFromUrdfString(model, tiago_urdf(), kind, [str(package_directory())])
        assert geometry.ngeoms > 30


def test_home_pose_puts_the_grippers_where_they_are_on_the_robot(model):
    left = _frame(model, _home(), "gripper_left_grasping_frame")
    right = _frame(model, _home(), "gripper_right_grasping_frame")
    np.testing.assert_allclose(left[:3, 3], (0.174, 0.221, 0.713), atol=2e-3)
    np.testing.assert_allclose(right[:3, 3], (0.174, -0.221, 0.713), atol=4e-3)


def test_grasping_frame_approaches_along_x_and_opens_along_y(model):
    tool = _frame(model, _home(), "arm_left_tool_link")
    grasp = _frame(model, _home(), "gripper_left_grasping_frame")
    assert np.linalg.norm(grasp[:3, 3] - tool[:3, 3]) == pytest.approx(0.151, abs=1e-3)
    np.testing.assert_allclose(grasp[:3, 0], tool[:3, 0], atol=1e-4)
    closed = _frame(model, _home(), "gripper_left_left_finger_link")
    opened = _frame(model, {**_home(), "gripper_left_left_finger_joint": 0.04}, "gripper_left_left_finger_link")
    np.testing.assert_allclose((opened - closed)[:3, 3], 0.04 * grasp[:3, 1], atol=1e-6)


def test_camera_is_where_it_is_on_the_robot_and_looks_ahead(model):
    camera = _frame(model, {"torso_lift_joint": 0.2}, "head_front_camera_rgb_optical_frame")
    np.testing.assert_allclose(camera[:3, 3], (0.216, 0.022, 1.2665), atol=1.5e-2)
    np.testing.assert_allclose(camera[:3, 2], (1.0, 0.0, 0.0), atol=1e-3)
    down = _frame(model, {"head_2_joint": -0.5}, "head_front_camera_rgb_optical_frame")
    assert down[2, 2] < -0.4


@pytest.mark.parametrize(
    ("joint", "lower", "upper", "velocity", "effort"),
    [
        ("torso_lift_joint", 0.0, 0.35, 0.07, 2000.0),
        ("head_2_joint", -1.0472, 0.7854, 3.0, 2.77),
        ("arm_left_1_joint", -1.1781, 1.5708, 1.95, 43.0),
        ("arm_right_3_joint", -0.7854, 3.9270, 2.35, 26.0),
        ("arm_right_7_joint", -2.0944, 2.0944, 1.76, 6.6),
        ("gripper_left_right_finger_joint", 0.0, 0.045, 0.05, 16.0),
    ],
)
def test_limits_are_those_of_the_robot(model, joint, lower, upper, velocity, effort):
    index = model.joints[model.getJointId(joint)]
    assert model.lowerPositionLimit[index.idx_q] == pytest.approx(lower, abs=1e-3)
    assert model.upperPositionLimit[index.idx_q] == pytest.approx(upper, abs=1e-3)
    assert model.velocityLimit[index.idx_v] == pytest.approx(velocity)
    assert model.effortLimit[index.idx_v] == pytest.approx(effort)


def test_no_trace_of_the_hands_and_few_enough_joints_for_pybullet():
    robot = ET.fromstring(tiago_urdf())
    names = [element.get("name") for element in (*robot.findall("link"), *robot.findall("joint"))]
    assert not [name for name in names if "hand_" in name or "xtion" in name]
    assert len(robot.findall("joint")) < 128
    assert len(set(names)) == len(names)


def test_inertias_are_those_of_solid_bodies():
    for inertia in ET.fromstring(tiago_urdf()).iter("inertia"):
        xx, xy, xz, yy, yz, zz = (float(inertia.get(f"i{key}")) for key in ("xx", "xy", "xz", "yy", "yz", "zz"))
        principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        assert principal[0] > 0.0
        assert principal[0] + principal[1] >= principal[2]
