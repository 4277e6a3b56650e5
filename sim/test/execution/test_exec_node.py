# SPDX-License-Identifier: Apache-2.0
"""The node: what it offers, and what it does without a robot."""

import threading

import numpy as np
import pytest
import rclpy
from exec_fixtures import TABLE_Z, ball_cloud, robot
from geometry_msgs.msg import Point32, Polygon
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Empty
from std_srvs.srv import Trigger
from uncom_common.conversions import header_to_msg
from uncom_common.primitive import Primitive
from uncom_perception.conversions import detection_to_msg
from uncom_sim.bench_planning.scenes import detection
from uncom_tiago_exec.conversions import goal_to_msg, status_from_msg, status_to_msg, task_from_msg, trajectory_from_msg
from uncom_tiago_exec.execution_node import ExecutionNode
from uncom_tiago_exec.types import BasePose, Stage, Status, Trajectory

from uncom_interfaces.msg import Answer, Command, ExecutionStatus, GroundedCommand, GroundedTarget

DOMAIN = 82


def command():
    thing = detection("ball", ball_cloud(0.6, 0.2, 0.03, np.random.default_rng(0)))
    msg = GroundedCommand(
        header=header_to_msg(1.0, "base_footprint"), utterance_id="u7", primitive=Command.PRIMITIVE_PICK
    )
    msg.object = detection_to_msg(thing, msg.header)
    msg.scene = [msg.object]
    msg.object_text = "ball"
    msg.table.found = True
    corners = ((0.45, -0.5), (0.95, -0.5), (0.95, 0.5), (0.45, 0.5))
    msg.table.polygon = Polygon(points=[Point32(x=x, y=y, z=TABLE_Z) for x, y in corners])
    msg.table.height = TABLE_Z
    return msg


class Graph:
    """The node under test and a listener in one context."""

    def __init__(self, **parameters):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.node = ExecutionNode(context=self.context, parameter_overrides=overrides)
        self.listener = rclpy.create_node("listener", context=self.context)
        self.seen = []
        self.changed = threading.Condition()
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.listener.create_subscription(ExecutionStatus, "/uncom/execution_status", self._keep(self.seen), latched)
        self.commands = self.listener.create_publisher(GroundedCommand, "/uncom/grounded_command", 10)
        self.answers = self.listener.create_publisher(Answer, "/uncom/answer", 10)
        self.stops = self.listener.create_publisher(Empty, "/uncom/stop", 10)
        self.executor = MultiThreadedExecutor(num_threads=3, context=self.context)
        self.executor.add_node(self.node)
        self.executor.add_node(self.listener)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()

    def _keep(self, store):
        def keep(msg):
            with self.changed:
                store.append(msg)
                self.changed.notify_all()

        return keep

    def wait(self, condition, timeout=20.0):
        with self.changed:
            assert self.changed.wait_for(condition, timeout), [m.stage_name for m in self.seen]

    def close(self):
        self.executor.shutdown(timeout_sec=5.0)
        self.node.destroy_node()
        self.listener.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def graph():
    made = []

    def make(**parameters):
        made.append(Graph(**parameters))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_it_tells_idle_to_who_comes_late(graph):
    g = graph()
    g.wait(lambda: g.seen and g.seen[0].stage == ExecutionStatus.IDLE)


def test_without_a_robot_a_command_fails_in_words(graph):
    g = graph(require_approval=False)
    g.wait(lambda: g.commands.get_subscription_count() > 0 or bool(g.seen))
    g.commands.publish(command())
    g.wait(lambda: any(m.stage == ExecutionStatus.FAILED for m in g.seen))
    failed = next(m for m in g.seen if m.stage == ExecutionStatus.FAILED)
    assert failed.utterance_id == "u7"
    assert "robot_description has not arrived" in failed.detail


def test_a_failed_grounding_starts_nothing(graph):
    g = graph(require_approval=False)
    g.wait(lambda: bool(g.seen))
    bad = command()
    bad.status, bad.utterance_id = GroundedCommand.FAILED, "bad"
    g.commands.publish(bad)
    g.commands.publish(command())
    g.wait(lambda: any(m.stage == ExecutionStatus.FAILED for m in g.seen))
    assert all(m.utterance_id != "bad" for m in g.seen)


def test_nothing_moves_without_a_yes_to_the_very_question(graph):
    """A yes without a question's id, or with another one's, is none; a no refuses."""
    g = graph(require_approval=True)
    g.node._model = robot()
    g.wait(lambda: bool(g.seen))
    g.commands.publish(command())
    g.wait(lambda: any(m.stage == ExecutionStatus.AWAITING_APPROVAL for m in g.seen))
    for name in ("", "approve-u6-0"):
        g.answers.publish(Answer(question_id=name, answer=Answer.YES))
    g.answers.publish(Answer(question_id="approve-u7-0", answer=Answer.NO))
    g.wait(lambda: any(m.stage == ExecutionStatus.FAILED for m in g.seen))
    assert all(m.stage != ExecutionStatus.PLANNING for m in g.seen)
    assert "not approved" in next(m.detail for m in g.seen if m.stage == ExecutionStatus.FAILED)


def test_a_stop_holds_until_reset(graph):
    g = graph(require_approval=False)
    g.wait(lambda: bool(g.seen))
    g.stops.publish(Empty())
    g.wait(lambda: any(m.stage == ExecutionStatus.STOPPED for m in g.seen))
    g.commands.publish(command())
    g.wait(lambda: any(m.stage == ExecutionStatus.FAILED for m in g.seen))
    assert "/uncom/reset" in next(m.detail for m in g.seen if m.stage == ExecutionStatus.FAILED)
    reset = g.listener.create_client(Trigger, "/uncom/reset")
    assert reset.wait_for_service(10.0)
    count = len(g.seen)
    future = reset.call_async(Trigger.Request())
    g.wait(lambda: future.done() and any(m.stage == ExecutionStatus.IDLE for m in g.seen[count:]))
    assert future.result().success
    g.commands.publish(command())
    g.wait(lambda: any("robot_description has not arrived" in m.detail for m in g.seen[count:]))


def test_a_command_survives_the_way_into_a_task():
    task = task_from_msg(command())
    assert task.primitive is Primitive.PICK
    assert task.table.height_m == pytest.approx(TABLE_Z)
    assert len(task.object.geometry.cloud) > 100
    assert task.target is None


def test_status_and_trajectory_survive_the_round_trip():
    status = Status(Stage.LIFTING, "straight up", "left", {"duration_s": 1.5})
    assert status_from_msg(status_to_msg(status, header_to_msg(1.0, "x"), "u", 0)) == status
    motion = Trajectory(("a", "b"), np.array([0.0, 0.5]), np.array([[0.0, 1], [2, 3]]), np.array([[0.0, 0], [1, 1]]))
    back = trajectory_from_msg(goal_to_msg(motion, ("b",)).trajectory)
    assert back.joint_names == ("b",)
    assert np.allclose(back.positions[:, 0], [1, 3])
    assert np.allclose(back.times, motion.times)


def test_stages_are_those_of_the_message():
    for stage in Stage:
        assert getattr(ExecutionStatus, stage.name) == stage.value


@pytest.mark.parametrize(
    ("said", "label", "named"), [("this bowl", "bowl", "bowl"), ("this", "mug", "mug"), ("here", "", "")]
)
def test_things_are_named_without_pointing_words(said, label, named):
    msg = command()
    msg.target_text, msg.target.object.label = said, label
    assert task_from_msg(msg).target_text == named


@pytest.mark.parametrize(("frame", "expected"), [("base_footprint", (2.0, 1.6)), ("odom", (0.6, 0.0))])
def test_a_command_is_taken_to_odom_from_where_the_base_stood_at_its_stamp(graph, monkeypatch, frame, expected):
    node = graph().node
    asked = []
    monkeypatch.setattr(
        node._robot, "base_pose", lambda stamp_s: asked.append(stamp_s) or BasePose(2.0, 1.0, np.pi / 2.0)
    )
    msg = command()
    msg.header.frame_id = frame
    msg.target.kind = GroundedTarget.AREA
    msg.target.pose.position.x, msg.target.pose.position.z = 0.6, TABLE_Z
    task = node._task_in_odom(msg)
    assert task.target_pose[:2, 3] == pytest.approx(expected)
    assert asked == ([1.0] if frame == "base_footprint" else [])
