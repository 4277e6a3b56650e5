# SPDX-License-Identifier: Apache-2.0
"""The driver node offers what the robot offers, under the robot's names."""

import json
import threading

import numpy as np
import pytest
import rclpy
from action_msgs.msg import GoalStatus
from audio_common_msgs.msg import AudioDataStamped, AudioInfo
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance, JointTrajectoryControllerState
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_common.conversions import (
    camera_from_msg,
    depth_from_msg,
    duration_to_msg,
    rgb_from_msg,
    seconds_from_msg,
    stamped_transform_from_msg,
)
from uncom_common.exceptions import InvalidConfigError
from uncom_common.transforms import TransformBuffer
from uncom_sim.camera.views import HEAD_CAMERA
from uncom_sim.driver.driver_config import DriverConfig
from uncom_sim.driver.ros.conversions import trajectory_from_msg, trajectory_to_msg
from uncom_sim.driver_node import DriverNode
from uncom_sim.exceptions import SceneError

from uncom_interfaces.msg import SimState

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SCENE = {
    "objects": [{"id": "lemon_1", "kind": "lemon", "colour": "yellow", "x": 0.65, "y": 0.1}],
    "say": "take the lemon",
    "point_object": "lemon_1",
    "point_target": None,
}


class _Listener:
    """Collects messages and waits for those that satisfy a condition."""

    def __init__(self, node, kind, topic, qos=10):
        self.messages, self._condition = [], threading.Condition()
        node.create_subscription(kind, topic, self._on_message, qos)

    def _on_message(self, message):
        with self._condition:
            self.messages.append(message)
            del self.messages[:-500]
            self._condition.notify_all()

    def wait(self, wanted=lambda _: True, timeout_s=60.0):
        with self._condition:
            assert self._condition.wait_for(lambda: any(map(wanted, self.messages)), timeout_s), "no such message"
            return next(m for m in reversed(self.messages) if wanted(m))


class _Robot:
    def __init__(self, folder):
        scene = folder / "scene.json"
        scene.write_text(json.dumps(SCENE))
        self.context = Context()
        self.claim = DomainClaim()
        rclpy.init(context=self.context, domain_id=self.claim.domain)
        parameters = {"scene_file": str(scene), "seed": 2, "real_time_factor": 0.0, "camera_rate_hz": 5.0}
        self.driver = DriverNode(
            context=self.context, parameter_overrides=[Parameter(k, value=v) for k, v in parameters.items()]
        )
        self.node = Node("tester", context=self.context)
        self.executor = MultiThreadedExecutor(2, context=self.context)
        for node in (self.driver, self.node):
            self.executor.add_node(node)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()
        self.joints = _Listener(self.node, JointState, "/joint_states")

    def close(self):
        self.executor.shutdown(timeout_sec=5.0)
        self.driver.destroy_node()
        self.node.destroy_node()
        self.context.try_shutdown()
        self.thread.join(10.0)
        self.claim.close()

    @staticmethod
    def result(future):
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        assert done.wait(60.0), "no answer"
        return future.result()

    def client(self, controller):
        client = ActionClient(self.node, FollowJointTrajectory, f"/{controller}/follow_joint_trajectory")
        assert client.wait_for_server(timeout_sec=20.0)
        return client

    def position(self, name):
        message = self.joints.wait()
        return message.position[list(message.name).index(name)]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    made = _Robot(tmp_path_factory.mktemp("scene"))
    yield made
    made.close()


def _goal(names, positions, seconds):
    goal = FollowJointTrajectory.Goal()
    goal.trajectory.joint_names = list(names)
    goal.trajectory.points = [
        JointTrajectoryPoint(positions=[float(p) for p in positions], time_from_start=duration_to_msg(seconds))
    ]
    return goal


HEAD = ("head_1_joint", "head_2_joint")


def test_clock_runs_from_a_time_above_zero_at_the_rate_asked_for(robot):
    clock = _Listener(robot.node, Clock, "/clock", 500)
    first = seconds_from_msg(clock.wait().clock)
    assert first >= 10.0
    clock.wait(lambda m: seconds_from_msg(m.clock) > first + 1.0)
    times = np.array([seconds_from_msg(m.clock) for m in clock.messages])
    # a step of physics is 1/240 s: the interval is right to within one
    assert abs(np.median(np.diff(times)) - 1.0 / robot.driver.config.clock_rate_hz) <= 1.0 / 240.0 + 1e-9


def test_transforms_lead_from_odom_to_camera_and_grippers_as_the_description_says(robot):
    buffer = TransformBuffer()
    static = _Listener(robot.node, TFMessage, "/tf_static", LATCHED).wait()
    moving = _Listener(robot.node, TFMessage, "/tf").wait()
    for message, fixed in ((static, True), (moving, False)):
        for transform in message.transforms:
            buffer.add(stamped_transform_from_msg(transform), static=fixed)
    camera = buffer.lookup("head_front_camera_rgb_optical_frame", "odom")
    assert camera[2, 3] == pytest.approx(1.309, abs=0.005)
    assert camera[2, 2] < -0.5, "it looks down at the table"
    description = _Listener(robot.node, String, "/robot_description", LATCHED).wait().data
    for frame in ("gripper_left_grasping_frame", "wrist_right_ft_link", "base_link", "torso_lift_link"):
        assert frame in buffer.frames()
        assert f'<link name="{frame}"' in description
        buffer.lookup(frame, "base_footprint")


def test_camera_gives_colour_distance_and_intrinsics_with_one_stamp(robot):
    topics = {
        "rgb/image_raw": Image,
        "depth_registered/image_raw": Image,
        "rgb/camera_info": CameraInfo,
        "depth_registered/camera_info": CameraInfo,
    }
    listeners = {topic: _Listener(robot.node, kind, f"/head_front_camera/{topic}") for topic, kind in topics.items()}
    stamp = listeners["depth_registered/camera_info"].wait().header.stamp
    rgb, depth, info, _ = (
        listener.wait(lambda m: seconds_from_msg(m.header.stamp) >= seconds_from_msg(stamp))
        for listener in listeners.values()
    )
    assert rgb.encoding == "rgb8"
    assert depth.encoding == "32FC1"
    assert rgb.header.frame_id == depth.header.frame_id == "head_front_camera_rgb_optical_frame"
    assert camera_from_msg(info) == HEAD_CAMERA
    assert rgb_from_msg(rgb).std() > 10
    assert np.nanmedian(depth_from_msg(depth)) == pytest.approx(0.9, abs=0.4)


def test_a_goal_moves_the_joints_and_succeeds(robot):
    feedback = []
    handle = robot.result(
        robot.client("head_controller").send_goal_async(
            _goal(HEAD, (0.4, -0.5), 1.0), feedback_callback=feedback.append
        )
    )
    assert handle.accepted
    answer = robot.result(handle.get_result_async())
    assert answer.status == GoalStatus.STATUS_SUCCEEDED
    assert answer.result.error_code == FollowJointTrajectory.Result.SUCCESSFUL
    robot.joints.wait(lambda m: abs(m.position[list(m.name).index("head_1_joint")] - 0.4) < 0.02)
    assert feedback
    assert list(feedback[-1].feedback.joint_names) == list(HEAD)


def test_a_goal_that_does_not_name_all_joints_is_rejected(robot):
    handle = robot.result(robot.client("head_controller").send_goal_async(_goal(HEAD[:1], (0.4,), 1.0)))
    assert not handle.accepted


def test_cancel_stops_the_joints_on_their_way(robot):
    client = robot.client("torso_controller")
    handle = robot.result(client.send_goal_async(_goal(["torso_lift_joint"], (0.1,), 20.0)))
    robot.joints.wait(lambda m: m.position[list(m.name).index("torso_lift_joint")] < 0.33)
    robot.result(handle.cancel_goal_async())
    assert robot.result(handle.get_result_async()).status == GoalStatus.STATUS_CANCELED
    here = robot.position("torso_lift_joint")
    assert 0.12 < here < 0.34
    later = seconds_from_msg(robot.joints.wait().header.stamp) + 1.0
    robot.joints.wait(lambda m: seconds_from_msg(m.header.stamp) > later)
    assert robot.position("torso_lift_joint") == pytest.approx(here, abs=5e-3)


def test_a_new_goal_takes_the_place_of_the_old_one(robot):
    client = robot.client("head_controller")
    first = robot.result(client.send_goal_async(_goal(HEAD, (-0.8, -0.2), 30.0)))
    second = robot.result(client.send_goal_async(_goal(HEAD, (0.1, -0.8), 0.8)))
    assert robot.result(first.get_result_async()).status == GoalStatus.STATUS_ABORTED
    assert robot.result(second.get_result_async()).status == GoalStatus.STATUS_SUCCEEDED


def test_a_path_tolerance_that_cannot_be_kept_aborts_with_its_code(robot):
    goal = _goal(["torso_lift_joint"], (0.0,), 0.2)  # ten times faster than the torso is
    goal.path_tolerance = [JointTolerance(name="torso_lift_joint", position=0.01)]
    handle = robot.result(robot.client("torso_controller").send_goal_async(goal))
    answer = robot.result(handle.get_result_async())
    assert answer.status == GoalStatus.STATUS_ABORTED
    assert answer.result.error_code == FollowJointTrajectory.Result.PATH_TOLERANCE_VIOLATED
    assert "torso_lift_joint" in answer.result.error_string


def test_trajectories_on_the_topic_are_followed_and_the_state_is_told(robot):
    state = _Listener(robot.node, JointTrajectoryControllerState, "/gripper_right_controller/controller_state")
    names = ["gripper_right_right_finger_joint", "gripper_right_left_finger_joint"]
    sender = robot.node.create_publisher(JointTrajectory, "/gripper_right_controller/joint_trajectory", 10)
    state.wait()
    sender.publish(_goal(names, (0.03, 0.03), 1.0).trajectory)
    reached = state.wait(lambda m: min(m.feedback.positions) > 0.029)
    assert list(reached.joint_names) == names


def test_base_moves_while_commanded_and_the_odometry_tells(robot):
    odometry = _Listener(robot.node, Odometry, "/mobile_base_controller/odom")
    sender = robot.node.create_publisher(TwistStamped, "/mobile_base_controller/cmd_vel", 10)
    start = odometry.wait().pose.pose.position.x
    message = TwistStamped()
    message.twist.linear.x = -0.1
    moving = threading.Event()

    def push():
        if not moving.is_set():
            sender.publish(message)

    timer = robot.node.create_timer(0.01, push)
    odometry.wait(lambda m: m.pose.pose.position.x < start - 0.03)
    moving.set()
    timer.cancel()
    odometry.wait(lambda m: abs(m.twist.twist.linear.x) < 1e-3 and m.pose.pose.position.x < start - 0.03)


def test_sound_is_continuous_and_the_voice_comes_after_the_start(robot):
    info = _Listener(robot.node, AudioInfo, "/audio_info", LATCHED).wait()
    assert (info.sample_rate, info.channels, info.sample_format) == (16000, 1, "S16LE")
    audio = _Listener(robot.node, AudioDataStamped, "/audio", 500)
    state = _Listener(robot.node, SimState, "/sim/state")
    assert not state.wait().person_done

    def loudness(message):
        return np.abs(np.frombuffer(bytes(message.audio.data), "<i2").astype(int)).max()

    assert loudness(audio.wait()) < 100
    start = robot.node.create_client(Trigger, "/sim/start")
    assert start.wait_for_service(timeout_sec=20.0)
    assert robot.result(start.call_async(Trigger.Request())).success
    audio.wait(lambda m: loudness(m) > 1000)
    told = state.wait(lambda m: m.person_done)
    assert list(told.words) == ["take", "the", "lemon"]
    assert [o.id for o in told.objects] == ["lemon_1"]
    stamps = np.array([seconds_from_msg(m.header.stamp) for m in audio.messages])
    np.testing.assert_allclose(np.diff(stamps), 0.05, atol=1e-6)


def test_trajectories_survive_the_way_into_a_message_and_back():
    goal = _goal(HEAD, (0.4, -0.5), 1.25)
    goal.trajectory.points[0].velocities = [0.0, 0.0]
    again = trajectory_from_msg(trajectory_to_msg(trajectory_from_msg(goal.trajectory)))
    assert again.joints == HEAD
    assert again.points[0].time_s == 1.25
    np.testing.assert_array_equal(again.points[0].positions, (0.4, -0.5))
    np.testing.assert_array_equal(again.points[0].velocities, (0.0, 0.0))
    assert again.points[0].accelerations is None


@pytest.mark.parametrize(("name", "value"), [("seed", -1), ("camera_rate_hz", 0.0), ("real_time_factor", -1.0)])
def test_parameters_that_make_no_sense_are_refused(name, value):
    with pytest.raises(InvalidConfigError, match=name):
        DriverConfig(**{name: value})


def test_a_missing_scene_file_is_named(tmp_path):
    with pytest.raises(SceneError, match=r"no scene file .*nothing\.json"):
        DriverConfig(scene_file=str(tmp_path / "nothing.json")).scene()
