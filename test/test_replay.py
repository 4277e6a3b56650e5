# SPDX-License-Identifier: Apache-2.0
"""What a bag holds arrives in the live graph: whole, in order, at its own pace, images plain and compressed."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import Header, String
from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.graph.topics import DEPTH, RGB, Form, Role, Topic
from uncom_bringup.monitor.conversions import compressed_from_image
from uncom_bringup.replay.playback_clock import Playback, prefetch
from uncom_bringup.replay.player_node import PlayerNode, chosen_topics
from uncom_bringup.replay.recorder_node import RecorderNode
from uncom_common.conversions import depth_from_msg, depth_to_msg, rgb_from_msg, rgb_to_msg, time_to_msg

TIMEOUT_S = 30.0
COUNT = 20
PERIOD_NS = 50_000_000
START_NS = 5_000_000_000


@pytest.fixture
def bag_path(tmp_path):
    rng = np.random.default_rng(7)
    path = tmp_path / "take.mcap"
    with BagWriter(path) as bag:
        bag.add_topic(RGB.stored_name, "sensor_msgs/msg/CompressedImage")
        bag.add_topic(DEPTH.stored_name, "sensor_msgs/msg/CompressedImage")
        bag.add_topic("/robot_description", "std_msgs/msg/String", latched=True)
        bag.add_topic("/uncom/say", "std_msgs/msg/String")
        bag.write("/robot_description", START_NS, serialize_message(String(data="<robot/>")))
        for number in range(COUNT):
            now = START_NS + number * PERIOD_NS
            header = Header(stamp=time_to_msg(1e-9 * now), frame_id="camera")
            colour = np.kron(rng.integers(0, 255, (6, 8, 3), np.uint8), np.ones((80, 80, 1), np.uint8))
            depth = np.full((480, 640), 1.0 + 0.01 * number, np.float32)
            for topic, image in ((RGB, rgb_to_msg(colour, header)), (DEPTH, depth_to_msg(depth, header))):
                bag.write(topic.stored_name, now, serialize_message(compressed_from_image(image, topic.form)))
            bag.write("/uncom/say", now, serialize_message(String(data="old")))
    return path


class Ear:
    """Hears topics in a context of its own and keeps when."""

    def __init__(self, domain, topics):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("ear", context=self.context)
        self.heard = {name: [] for _, name, _ in topics}
        for kind, name, latched in topics:
            qos = QoSProfile(depth=100)
            if latched:
                qos.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL
            self.node.create_subscription(kind, name, self._keeper(name), qos)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()

    def _keeper(self, name):
        return lambda msg: self.heard[name].append((time.monotonic(), msg))

    def wait(self, condition):
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert time.monotonic() < deadline, {name: len(got) for name, got in self.heard.items()}
            time.sleep(0.005)

    def close(self):
        self.executor.shutdown(timeout_sec=2.0)
        self.thread.join(timeout=5.0)
        self.node.destroy_node()
        self.context.try_shutdown()


@pytest.fixture
def ear(domain):
    ear = Ear(
        domain,
        [
            (Image, RGB.name, False),
            (Image, DEPTH.name, False),
            (String, "/robot_description", True),
            (String, "/uncom/say", False),
            (Clock, "/clock", False),
        ],
    )
    yield ear
    ear.close()


@pytest.fixture
def context(domain):
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    yield context
    context.try_shutdown()


def test_a_bag_arrives_whole_in_order_and_at_its_pace(bag_path, ear, context):
    with BagReader(bag_path) as bag:
        player = PlayerNode(chosen_topics(bag, ()), clock=True, context=context)
        ear.wait(lambda: all(p.image is None or p.image.get_subscription_count() for p in player._channels.values()))
        items = prefetch(player.prepare(message) for message in bag.messages(player.published_topics))
        played = Playback(player.send, player.tell_time).play(items, bag.start_ns, 1.0)
        ear.wait(lambda: min(len(ear.heard[RGB.name]), len(ear.heard[DEPTH.name])) == COUNT)
    depths = [float(np.nanmean(depth_from_msg(msg))) for _, msg in ear.heard[DEPTH.name]]
    assert depths == pytest.approx([1.0 + 0.01 * n for n in range(COUNT)], abs=0.002)
    assert rgb_from_msg(ear.heard[RGB.name][0][1]).shape == (480, 640, 3)
    assert [msg.data for _, msg in ear.heard["/robot_description"]] == ["<robot/>"]
    assert not ear.heard["/uncom/say"], "what our own nodes said is the live graph's to say"
    arrived = np.array([when for when, _ in ear.heard[DEPTH.name]])
    assert (arrived[-1] - arrived[0]) == pytest.approx(1e-9 * PERIOD_NS * (COUNT - 1), abs=0.1)
    assert played.ended
    # Within 5 ms where the machine is not busy otherwise; half of the time at least where it is.
    assert played.median_late_s < 0.005
    clock = [msg.clock.sec + 1e-9 * msg.clock.nanosec for _, msg in ear.heard["/clock"]]
    assert clock == sorted(clock)
    assert clock[0] >= 5.0
    player.destroy_node()


def test_a_new_name_of_an_image_is_one_of_its_compressed_form_too(bag_path, context):
    with BagReader(bag_path) as bag:
        remap = {RGB.name: "/eye", "/robot_description": "/body"}
        player = PlayerNode(chosen_topics(bag, ()), remap=remap, context=context)
    names = {name for name, _ in player.get_publisher_names_and_types_by_node("uncom_player", "/")}
    assert {"/eye", "/eye/compressed", "/body", DEPTH.name, DEPTH.stored_name} <= names
    assert not {RGB.name, RGB.stored_name, "/robot_description"} & names
    player.destroy_node()


def test_only_what_is_asked_for_is_replayed(bag_path):
    with BagReader(bag_path) as bag:
        assert {topic.name for topic in chosen_topics(bag, ["/uncom/say"])} == {"/uncom/say"}
        assert "/uncom/say" not in {topic.name for topic in chosen_topics(bag, ())}
        with pytest.raises(BadInputError, match="/no/such"):
            chosen_topics(bag, ["/no/such"])


def test_what_is_said_is_recorded_with_the_time_it_was_said(tmp_path, domain, context):
    """Latched messages from before the clock runs get its first time; images are compressed."""
    path = tmp_path / "live.mcap"
    now = {"ns": 0}
    topics = [
        Topic("/robot_description", "std_msgs/msg/String", Role.SENSE, latched=True),
        Topic("/words", "std_msgs/msg/String"),
        Topic("/picture", "sensor_msgs/msg/Image", form=Form.IMAGE),
    ]
    seen = []
    recorder = RecorderNode(
        BagWriter(path),
        topics,
        now_ns=lambda: now["ns"],
        on_compressed=lambda t, m: seen.append(t.name),
        context=context,
    )
    speaker = Node("speaker", context=context)
    latched = speaker.create_publisher(
        String, "/robot_description", QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    )
    words = speaker.create_publisher(String, "/words", 10)
    pictures = speaker.create_publisher(Image, "/picture", 10)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(recorder)
    deadline = time.monotonic() + TIMEOUT_S

    def spin_until(condition):
        while not condition():
            assert time.monotonic() < deadline
            executor.spin_once(timeout_sec=0.05)

    latched.publish(String(data="<robot/>"))
    spin_until(lambda: words.get_subscription_count() and pictures.get_subscription_count())
    spin_until(lambda: recorder._queue.empty() and recorder._held)
    now["ns"] = 7_000_000_000
    words.publish(String(data="one"))
    pictures.publish(rgb_to_msg(np.zeros((48, 64, 3), np.uint8), Header()))
    spin_until(lambda: seen)
    spin_until(lambda: recorder._bag.count == 3)
    recorder.finish()
    executor.shutdown()
    recorder.destroy_node()
    speaker.destroy_node()
    with BagReader(path) as bag:
        messages = {message.topic.name: message for message in bag.messages()}
    assert set(messages) == {"/robot_description", "/words", "/picture/compressed"}
    assert {message.time_ns for message in messages.values()} == {7_000_000_000}
