# SPDX-License-Identifier: Apache-2.0
"""Publishes a bag into the live graph."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from uncom_common.conversions import time_to_msg

from uncom_bringup import output
from uncom_bringup.bags.bag_reader import BagMessage, BagReader, BagTopic
from uncom_bringup.exceptions import BadInputError, UnknownTypeError
from uncom_bringup.graph.topics import NOT_REPLAYED
from uncom_bringup.monitor.conversions import compressed_to_image, message_class
from uncom_bringup.replay.options import PLAYER

_COMPRESSED = "sensor_msgs/msg/CompressedImage"
_TRANSPORTS = ("compressedDepth", "compressed")


@dataclass(frozen=True, slots=True)
class _Channel:
    """Where one topic of the bag goes: as it is, and decompressed."""

    raw: Any
    message_type: Any
    image: Any | None


@dataclass(frozen=True, slots=True)
class PreparedMessage:
    """A message that only has to be sent: who sends what bytes."""

    time_ns: int
    publications: tuple[tuple[Any, bytes], ...]


class PlayerNode(Node):
    """Publishes the messages of a bag, compressed images as plain ones too."""

    def __init__(
        self,
        topics: Collection[BagTopic],
        clock: bool = False,
        remap: Mapping[str, str] | None = None,
        **node_options: Any,
    ) -> None:
        """Make the publishers; a type that is not installed is skipped with one line."""
        super().__init__("uncom_player", **node_options)
        self._remap = dict(remap or {})
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
        base, _, transport = topic.name.rpartition("/")
        compressed = topic.type_name == _COMPRESSED and transport in _TRANSPORTS
        if compressed:
            image = self.create_publisher(Image, self._remap.get(base, base), QoSProfile(depth=10))
        # As image_transport does it, a new name of the image is a new name of its compressed form.
        name = f"{self._remap[base]}/{transport}" if compressed and base in self._remap else topic.name
        return _Channel(
            self.create_publisher(message_type, self._remap.get(topic.name, name), qos), message_type, image
        )

    def image_topic(self, topic: str) -> tuple[str, ...]:
        """Return the name under which a topic's compressed images are published as plain ones, if they are."""
        channel = self._channels.get(topic)
        return (channel.image.topic_name,) if channel is not None and channel.image is not None else ()

    def subscription_count(self, topic: str) -> int:
        """Return how many subscribers have been found for a topic of the bag, its plain images among them."""
        channel = self._channels.get(topic)
        publishers = (channel.raw, channel.image) if channel is not None else ()
        return sum(publisher.get_subscription_count() for publisher in publishers if publisher is not None)

    def wait_until_taken(self, limit_s: float) -> None:
        """Wait until whoever listens to what was published so far has it; none listens longer than limit_s."""
        deadline = time.monotonic() + limit_s
        for channel in self._channels.values():
            for publisher in (channel.raw, channel.image):
                if publisher is not None and publisher.get_subscription_count():
                    left = max(0.0, deadline - time.monotonic())
                    publisher.wait_for_all_acked(Duration(nanoseconds=int(1e9 * left)))

    def prepare(self, message: BagMessage) -> PreparedMessage:
        """Do all work that sending a message takes, but for sending it; may be called from another thread.

        A compressed image that is damaged is sent as it is only, with a warning.
        """
        channel = self._channels.get(message.topic.name)
        if channel is None:
            return PreparedMessage(message.time_ns, ())
        publications: list[tuple[Any, bytes]] = [(channel.raw, message.data)]
        if channel.image is not None and channel.image.get_subscription_count() > 0:
            try:
                image = compressed_to_image(deserialize_message(message.data, channel.message_type))
                publications.append((channel.image, serialize_message(image)))
            except BadInputError as error:
                self.get_logger().warning(f"{message.topic.name}: {error}", throttle_duration_sec=5.0)
        return PreparedMessage(message.time_ns, tuple(publications))

    def send(self, prepared: PreparedMessage) -> None:
        """Publish what was prepared."""
        for publisher, data in prepared.publications:
            publisher.publish(data)

    def publish(self, message: BagMessage) -> None:
        """Publish one message now."""
        self.send(self.prepare(message))

    def tell_time(self, time_ns: int) -> None:
        """Publish the bag's time on /clock, at most every 10 ms of it."""
        if self._clock is not None and not 0 <= time_ns - self._clock_ns < PLAYER.clock_period_ns:
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
