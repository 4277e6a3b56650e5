# SPDX-License-Identifier: Apache-2.0
"""Records the graph into a bag: raw bytes as they come, camera images compressed."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CompressedImage

from uncom_bringup import output
from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.exceptions import BadInputError, UnknownTypeError
from uncom_bringup.graph.topics import RECORDED, Form, Role, Topic
from uncom_bringup.monitor.conversions import compressed_from_image, message_class

_COMPRESSED = "sensor_msgs/msg/CompressedImage"
_STOP = (None, 0, b"")


class RecorderNode(Node):
    """Subscribes topics and writes them with the time of its clock.

    Callbacks only queue; a thread of its own compresses and writes. What arrives before the clock runs (latched
    topics, in simulated time) is written with the clock's first time.
    """

    def __init__(
        self,
        bag: BagWriter,
        topics: Sequence[Topic],
        *,
        now_ns: Callable[[], int] | None = None,
        on_compressed: Callable[[Topic, CompressedImage], None] | None = None,
        **node_options: Any,
    ) -> None:
        """Subscribe what is installed; a type that is not is one warning.

        Args:
            bag: where to write.
            topics: what to write.
            now_ns: another clock than the node's own [ns]; simulated time costs every node that follows it.
            on_compressed: gets each compressed image, too, in the writing thread.
            node_options: for rclpy.
        """
        super().__init__("uncom_recorder", **node_options)
        self._bag = bag
        self._now_ns = now_ns or (lambda: int(self.get_clock().now().nanoseconds))
        self._on_compressed = on_compressed
        self._queue: queue.SimpleQueue[tuple[Topic | None, int, bytes]] = queue.SimpleQueue()
        self._held: list[tuple[Topic, bytes]] = []
        for topic in topics:
            self._subscribe(topic)
        self._writer = threading.Thread(target=self._write_all, name="bag writer", daemon=True)
        self._writer.start()

    def _subscribe(self, topic: Topic) -> None:
        stored_type = topic.type_name if topic.form is Form.PLAIN else _COMPRESSED
        try:
            message_type = message_class(topic.type_name)
            self._bag.add_topic(topic.stored_name, stored_type, topic.latched)
        except UnknownTypeError as error:
            self.get_logger().warning(f"{topic.name} is not recorded: {error}")
            return
        qos = QoSProfile(depth=topic.depth)
        if topic.latched:
            qos.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL

        def store(data: bytes) -> None:
            self._queue.put((topic, self._now_ns(), data))

        self.create_subscription(message_type, topic.name, store, qos, raw=True)

    def _write_all(self) -> None:
        last_ns = 0
        while True:
            topic, time_ns, data = self._queue.get()
            if topic is None:
                break
            if time_ns == 0 and last_ns == 0:
                self._held.append((topic, data))
                continue
            last_ns = max(last_ns, time_ns)
            self._flush(last_ns)
            self._write(topic, last_ns, data)
        self._flush(last_ns)

    def _flush(self, time_ns: int) -> None:
        for topic, data in self._held:
            self._write(topic, time_ns, data)
        self._held.clear()

    def _write(self, topic: Topic, time_ns: int, data: bytes) -> None:
        if topic.form is not Form.PLAIN:
            image = deserialize_message(data, message_class(topic.type_name))
            compressed = compressed_from_image(image, topic.form)
            data = serialize_message(compressed)
            if self._on_compressed is not None:
                self._on_compressed(topic, compressed)
        self._bag.write(topic.stored_name, time_ns, data)

    def finish(self) -> Path:
        """Write what is queued and close the bag; returns its path."""
        self._queue.put(_STOP)
        self._writer.join()
        return self._bag.close()


def wanted_topics(names: Sequence[str], node: Node, patience_s: float = 2.0) -> list[Topic]:
    """Return the topics to record: the usual ones, or the named ones with their types as the graph has them.

    Raises:
        BadInputError: nobody publishes a named topic whose type is not known either.
    """
    if not names:
        return list(RECORDED)
    known = {topic.name: topic for topic in RECORDED}
    deadline = time.monotonic() + patience_s
    while True:
        live = {name: types[0] for name, types in node.get_topic_names_and_types() if types}
        missing = [name for name in names if name not in known and name not in live]
        if not missing or time.monotonic() > deadline:
            break
        time.sleep(0.1)
    if missing:
        raise BadInputError(f"nobody publishes {', '.join(missing)}; there are {', '.join(sorted(live))}")
    return [known.get(name) or Topic(name, live[name], Role.SENSE) for name in names]


def record(
    path: Path, *, storage: str, topics: Sequence[str], duration_s: float | None, use_sim_time: bool, force: bool
) -> int:
    """Record until Ctrl-C or for `duration_s`; the body of `uncom record`. Returns the exit status."""
    with BagWriter(path, storage, force) as bag:
        rclpy.init()
        executor = SingleThreadedExecutor()
        try:
            clock = [Parameter("use_sim_time", value=True)] if use_sim_time else []
            scout = Node("uncom_recorder_scout")
            chosen = wanted_topics(topics, scout)
            scout.destroy_node()
            node = RecorderNode(bag, chosen, parameter_overrides=clock)
            executor.add_node(node)
            output.note(f"recording {len(chosen)} topics to {path}; Ctrl-C ends it")
            deadline = None if duration_s is None else time.monotonic() + duration_s
            try:
                while rclpy.ok() and (deadline is None or time.monotonic() < deadline):
                    executor.spin_once(timeout_sec=0.2)
            except (KeyboardInterrupt, ExternalShutdownException):
                pass
            node.finish()
            node.destroy_node()
        finally:
            executor.shutdown(timeout_sec=2.0)
            rclpy.try_shutdown()
    output.emit(f"{path}: {bag.count} messages")
    return 0 if bag.count else 1
