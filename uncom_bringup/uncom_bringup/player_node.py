# SPDX-License-Identifier: Apache-2.0
"""Publishes a bag into the live graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from uncom_common.conversions import time_to_msg

from uncom_bringup import output
from uncom_bringup.bag_reader import BagMessage, BagReader, BagTopic
from uncom_bringup.conversions import compressed_to_image, message_class
from uncom_bringup.exceptions import BadInputError, UnknownTypeError
from uncom_bringup.topics import NOT_REPLAYED

_COMPRESSED = "sensor_msgs/msg/CompressedImage"
_SUFFIXES = ("/compressedDepth", "/compressed")
_CLOCK_PERIOD_NS = 10_000_000


@dataclass(frozen=True, slots=True)
class _Channel:
    """Where one topic of the bag goes: as it is, and decompressed."""

    raw: Any
    message_type: Any
    image: Any | None


class PlayerNode(Node):
    """Publishes the messages of a bag, compressed images as plain ones too."""

    def __init__(self, topics: Collection[BagTopic], clock: bool = False, **node_options: Any) -> None:
        """Make the publishers; a type that is not installed is skipped with one line."""
        super().__init__("uncom_player", **node_options)
        self._channels: dict[str, _Channel] = {}
        for topic in topics:
            try:
                self._channels[topic.name] = self._channel(topic)
            except UnknownTypeError as error:
                output.note(f"{topic.name} is left out: {error}")
        self._clock = self.create_publisher(Clock, "/clock", 10) if clock else None
        self._clock_ns = 0

    @property
    def published_topics(self) -> tuple[str, ...]:
        """Topics of the bag that are published."""
        return tuple(self._channels)

    def _channel(self, topic: BagTopic) -> _Channel:
        message_type = message_class(topic.type_name)
        qos = QoSProfile(depth=100)
        if topic.latched:
            qos.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL
        image = None
        if topic.type_name == _COMPRESSED and topic.name.endswith(_SUFFIXES):
            image = self.create_publisher(Image, topic.name.rsplit("/", 1)[0], QoSProfile(depth=10))
        return _Channel(self.create_publisher(message_type, topic.name, qos), message_type, image)

    def image_topic(self, topic: str) -> tuple[str, ...]:
        """Return the name under which a topic's compressed images are published as plain ones, if they are."""
        channel = self._channels.get(topic)
        return (channel.image.topic_name,) if channel is not None and channel.image is not None else ()

    def wait_until_taken(self, limit_s: float) -> None:
        """Wait until whoever listens to what was published so far has it; none listens longer than limit_s."""
        deadline = time.monotonic() + limit_s
        for channel in self._channels.values():
            for publisher in (channel.raw, channel.image):
                if publisher is not None and publisher.get_subscription_count():
                    left = max(0.0, deadline - time.monotonic())
                    publisher.wait_for_all_acked(Duration(nanoseconds=int(1e9 * left)))

    def publish(self, message: BagMessage) -> None:
        """Publish one message now.

        Raises:
            BadInputError: a compressed image is damaged.
        """
        channel = self._channels.get(message.topic.name)
        if channel is None:
            return
        channel.raw.publish(message.data)
        if channel.image is not None and channel.image.get_subscription_count() > 0:
            channel.image.publish(compressed_to_image(deserialize_message(message.data, channel.message_type)))

    def tell_time(self, time_ns: int) -> None:
        """Publish the bag's time on /clock, at most every 10 ms of it."""
        if self._clock is not None and not 0 <= time_ns - self._clock_ns < _CLOCK_PERIOD_NS:
            self._clock_ns = time_ns
            self._clock.publish(Clock(clock=time_to_msg(1e-9 * time_ns)))


def chosen_topics(bag: BagReader, names: Collection[str]) -> list[BagTopic]:
    """Return the topics to replay: the named ones, or all but what our own nodes and the simulator's scorer said.

    Raises:
        BadInputError: the bag lacks a named topic, or nothing is left to replay.
    """
    if names:
        known = {topic.name: topic for topic in bag.topics}
        missing = [name for name in names if name not in known]
        if missing:
            raise BadInputError(f"the bag has no {', '.join(missing)}; it has {', '.join(known)}")
        return [known[name] for name in names]
    chosen = [topic for topic in bag.topics if not topic.name.startswith(NOT_REPLAYED)]
    if not chosen:
        raise BadInputError(f"nothing to replay; name topics with --topics: {', '.join(t.name for t in bag.topics)}")
    return chosen


def replay(path: Path, *, rate: float, loop: bool, clock: bool, topics: Collection[str]) -> int:
    """Replay a bag; the body of `uncom replay`. Returns the exit status."""
    with BagReader(path) as bag:
        chosen = chosen_topics(bag, topics)
        rclpy.init()
        node = PlayerNode(chosen, clock)
        try:
            names = node.published_topics
            if not names:
                raise BadInputError(f"none of the bag's message types is installed here: {path}")
            output.note(f"replaying {bag.duration_s:.1f} s, {len(names)} topics, at rate {rate:g}")
            _wait_for_discovery(node)
            while True:
                count = play(bag, node, rate, names)
                output.note(f"{count} messages replayed")
                if not loop:
                    break
        except (KeyboardInterrupt, ExternalShutdownException):
            output.note("stopped")
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
    return 0


def _wait_for_discovery(node: Node, seconds: float = 1.0) -> None:
    """Give subscribers time to find the publishers: what is published before that is lost to them."""
    time.sleep(seconds)
    node.get_logger().debug("discovery time is over")


def play(
    bag: BagReader,
    node: PlayerNode,
    rate: float,
    names: Collection[str],
    watch: Callable[[], None] = lambda: None,
    published: Callable[[BagMessage], None] = lambda _: None,
) -> int:
    """Publish a bag once, at its own pace times `rate`, or slower. Returns how many messages.

    `watch` is called while waiting, and `published` after each message: time stands still until it returns.

    Raises:
        BagError: the bag is damaged from its first message on.
    """
    begin = time.monotonic()  # moved on while time stands still
    start_ns = bag.start_ns
    count = 0
    for message in bag.messages(names):
        offset_ns = message.time_ns - start_ns
        while True:
            ahead_s = 1e-9 * offset_ns / rate - (time.monotonic() - begin)
            if ahead_s <= 0.0:
                break
            # In simulated time the clock goes on between messages, too.
            node.tell_time(start_ns + int(1e9 * rate * (time.monotonic() - begin)))
            watch()
            time.sleep(min(ahead_s, 0.005))
        node.tell_time(message.time_ns)
        node.publish(message)
        count += 1
        paused = time.monotonic()
        published(message)
        begin += time.monotonic() - paused
    return count
