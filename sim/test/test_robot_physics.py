# SPDX-License-Identifier: Apache-2.0
"""The robot in PyBullet is the robot of its URDF, keeps its limits, drives, and holds things by friction alone."""

import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin
import pybullet
import pytest
from uncom_common.transforms import invert, matrix_from_pose, pose_from_matrix
from uncom_sim.robot.description import tiago_urdf
from uncom_sim.robot.joint_names import ACTUATED, ARMS, FINGERS, HOME_ARM
from uncom_sim.robot.kinematics import FrameTree, Kinematics
from uncom_sim.robot.robot import TIME_STEP_S, Robot, RobotOptions

OFFER = (1.47, 0.5776, 0.0601, 1.0064, -1.7003, 0.0)


def _client():
    client = pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(TIME_STEP_S, physicsClientId=client)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    return client


@pytest.fixture
def client():
    made = _client()
    yield made
    pybullet.disconnect(physicsClientId=made)


def _run(client, robot, seconds):
    for _ in range(round(seconds / TIME_STEP_S)):
        robot.apply()
        pybullet.stepSimulation(physicsClientId=client)
        robot.update()


def _aim(robot, pose):
    joints = np.array([ACTUATED.index(name) for name in pose])
    robot.set_targets(joints, np.array(list(pose.values()), dtype=float), np.zeros(len(pose)))


def test_every_frame_is_where_the_urdf_of_the_robot_puts_it(client):
    robot = Robot(client)
    model = pin.buildModelFromXML(tiago_urdf())
    q = pin.neutral(model)
    for name, value in robot.positions().items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    for frame in ("gripper_left_grasping_frame", "gripper_right_grasping_frame", "head_front_camera_rgb_optical_frame"):
        np.testing.assert_allclose(robot.frame(frame), data.oMf[model.getFrameId(frame)].homogeneous, atol=1e-4)
    for link in ("arm_left_7_link", "gripper_right_left_finger_link", "head_2_link"):
        state = pybullet.getLinkState(robot.body, robot.links[link], 0, 1, physicsClientId=client)
        np.testing.assert_allclose(state[4], data.oMf[model.getFrameId(link)].translation, atol=1e-4)


def test_nothing_of_its_weight_is_lost(client):
    robot = Robot(client)
    count = pybullet.getNumJoints(robot.body, physicsClientId=client)
    mass = sum(pybullet.getDynamicsInfo(robot.body, i, physicsClientId=client)[0] for i in range(-1, count))
    expected = sum(inertia.mass for inertia in pin.buildModelFromXML(tiago_urdf(), pin.JointModelFreeFlyer()).inertias)
    # Two links of the planar base are added, and what PyBullet gives `world`.
    assert mass == pytest.approx(expected + 2.0, abs=1.1)


def test_gravity_does_not_move_it_and_nothing_collides_at_rest(client):
    robot = Robot(client)
    before = robot.readings.position.copy()
    _run(client, robot, 1.0)
    np.testing.assert_allclose(robot.readings.position, before, atol=1e-3)
    assert not [c for c in pybullet.getContactPoints(robot.body, physicsClientId=client) if c[8] < 0.0]


def test_joints_reach_their_goal_no_faster_than_they_can(client):
    robot = Robot(client)
    pose = dict(zip(ARMS["left"], (*OFFER, 0.0), strict=True))
    _aim(robot, pose | {"torso_lift_joint": 0.25, "gripper_left_left_finger_joint": 0.04})
    fastest = np.zeros(len(ACTUATED))
    for _ in range(720):
        _run(client, robot, TIME_STEP_S)
        fastest = np.maximum(fastest, np.abs(robot.readings.velocity))
    assert np.all(fastest <= robot.max_velocity * 1.05 + 1e-3)
    positions = robot.positions()
    for name, goal in pose.items():
        assert positions[name] == pytest.approx(goal, abs=2e-3)
    assert positions["torso_lift_joint"] == pytest.approx(0.25, abs=2e-3)
    assert positions["gripper_left_left_finger_joint"] == pytest.approx(0.04, abs=5e-4)
    assert positions["gripper_left_right_finger_joint"] == pytest.approx(0.0, abs=5e-4)


def test_setpoints_beyond_the_limits_stop_at_them(client):
    robot = Robot(client)
    _aim(robot, {"head_1_joint": 9.0, "gripper_right_left_finger_joint": 1.0})
    _run(client, robot, 1.5)
    assert robot.positions()["head_1_joint"] == pytest.approx(1.309, abs=5e-3)
    assert robot.positions()["gripper_right_left_finger_joint"] == pytest.approx(0.045, abs=5e-4)


@pytest.mark.parametrize("arm_7", [0.0, 0.8])
def test_gripper_lifts_and_swings_a_box_of_300_g(client, arm_7):
    robot = Robot(client)
    pose = dict(zip(ARMS["left"], (*OFFER, arm_7), strict=True)) | dict.fromkeys(FINGERS["left"], 0.044)
    _aim(robot, pose)
    _run(client, robot, 3.0)
    grasp = robot.frame("gripper_left_grasping_frame")
    place = grasp.copy()
    place[:3, 3] += 0.06 * grasp[:3, 0]
    position, quaternion = pose_from_matrix(place)
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.025, 0.025, 0.04], physicsClientId=client)
    box = pybullet.createMultiBody(0.3, shape, -1, position, quaternion, physicsClientId=client)
    pybullet.changeDynamics(box, -1, lateralFriction=0.8, physicsClientId=client)
    stand = pybullet.createConstraint(
        box, -1, -1, -1, pybullet.JOINT_FIXED, [0] * 3, [0] * 3, position, [0, 0, 0, 1], quaternion, client
    )
    _aim(robot, dict.fromkeys(FINGERS["left"], 0.0))
    _run(client, robot, 1.2)
    pybullet.removeConstraint(stand, physicsClientId=client)

    def in_hand():
        at = matrix_from_pose(*pybullet.getBasePositionAndOrientation(box, physicsClientId=client))
        return (invert(robot.frame("gripper_left_grasping_frame")) @ at)[:3, 3]

    start = in_hand()
    _aim(robot, {"arm_left_1_joint": 0.9, "arm_left_4_joint": 1.4, "torso_lift_joint": 0.30})
    _run(client, robot, 3.0)
    assert np.linalg.norm(in_hand() - start) < 0.005
    gap = sum(robot.positions()[name] for name in FINGERS["left"])
    assert gap == pytest.approx(0.05, abs=2e-3)
    _aim(robot, dict.fromkeys(FINGERS["left"], 0.044))
    _run(client, robot, 1.0)
    assert np.linalg.norm(in_hand() - start) > 0.1, "an open gripper must let go"


def test_base_drives_in_arcs_and_stops(client):
    robot = Robot(client, RobotOptions(base=(1.0, 2.0, 0.5)))
    robot.set_base_velocity(0.3, 0.4)
    _run(client, robot, 2.0)
    x, y, yaw = robot.base_pose()
    assert yaw == pytest.approx(0.5 + 0.8, abs=0.01)
    radius = 0.3 / 0.4
    expected = (1.0 + radius * (np.sin(yaw) - np.sin(0.5)), 2.0 - radius * (np.cos(yaw) - np.cos(0.5)))
    np.testing.assert_allclose((x, y), expected, atol=0.01)
    assert robot.base_twist() == pytest.approx((0.3, 0.4), abs=0.01)
    robot.set_base_velocity(0.0, 0.0)
    _run(client, robot, 1.0)
    assert robot.base_twist() == pytest.approx((0.0, 0.0), abs=1e-3)


def test_two_robots_in_one_process_do_not_disturb_each_other():
    first, second = _client(), _client()
    one, two = Robot(first), Robot(second, RobotOptions(torso=0.1))
    _aim(one, {"head_1_joint": 0.5})
    _run(first, one, 0.5)
    assert one.positions()["head_1_joint"] == pytest.approx(0.5, abs=5e-3)
    assert two.positions()["head_1_joint"] == 0.0
    assert two.positions()["torso_lift_joint"] == pytest.approx(0.1)
    pybullet.disconnect(physicsClientId=first)
    _run(second, two, 0.1)
    pybullet.disconnect(physicsClientId=second)


def test_no_copy_of_the_robots_urdf_is_left_behind(client, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    Robot(client)
    assert not list(Path(tmp_path).rglob("*.urdf"))


def test_frames_computed_together_equal_those_computed_one_by_one():
    kinematics = Kinematics(tiago_urdf())
    joints = list(kinematics.joints.values())
    angles = np.random.default_rng(3).uniform(-0.5, 0.5, len(joints))
    places, quaternions = FrameTree(joints).poses(angles)
    for i, joint in enumerate(joints):
        expected = joint.transform(angles[i]) if joint.moves else joint.origin
        if joint.moves:
            np.testing.assert_allclose(matrix_from_pose(places[i], quaternions[i]), expected, atol=1e-9)
    assert kinematics.pose("arm_left_1_link", {}).shape == (4, 4)
    assert len(HOME_ARM) == len(ARMS["left"])
