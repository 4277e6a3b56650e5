# SPDX-License-Identifier: Apache-2.0
"""Listens to everything the graph says and gathers it for progress lines and the report."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from uncom_common.conversions import rgb_from_msg, seconds_from_msg

from uncom_bringup.bags.image_codec import encode_jpeg
from uncom_bringup.graph import topics
from uncom_bringup.graph.node_specs import (
    DETECT_SERVICE,
    DETECTION_NODE,
    EXECUTION_NODE,
    GESTURE_NODE,
    LANGUAGE_NODE,
    REASONER_NODE,
    SPEECH_NODE,
)
from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.conversions import message_class, plain_from_msg
from uncom_bringup.monitor.options import FRAME
from uncom_bringup.monitor.run_record import Event, Frame, RunRecord

_LISTENED = {
    run_record.TRANSCRIPT: topics.TRANSCRIPT,
    run_record.SPEECH_STATUS: topics.SPEECH_STATUS,
    run_record.COMMAND: topics.COMMAND,
    run_record.HANDS: topics.HANDS,
    run_record.GROUNDED: topics.GROUNDED_COMMAND,
    run_record.EXPLANATION: topics.EXPLANATION,
    run_record.EXECUTION: topics.EXECUTION_STATUS,
    run_record.SAY: topics.SAY,
    run_record.QUESTION: topics.QUESTION,
}
# What tells that a node works.
_SIGNS = {
    run_record.HANDS: (GESTURE_NODE.name, "first picture"),
    run_record.SPEECH_STATUS: (SPEECH_NODE.name, "first sound"),
    run_record.EXECUTION: (EXECUTION_NODE.name, "idle"),
}
_LISTENERS = {LANGUAGE_NODE.name: topics.TRANSCRIPT, REASONER_NODE.name: topics.COMMAND}


class MonitorNode(Node):
    """Gathers a RunRecord; `on_event` is called for each event, in the executor's thread, and must be short."""

    def __init__(
        self,
        on_event: Callable[[Event], None] | None = None,
        *,
        keep_camera: bool = True,
        keep_events: bool = True,
        overview_topic: str = "",
        **node_options: Any,
    ) -> None:
        """Subscribe; the camera only if its frames are to be kept. A monitor that stays for long keeps nothing."""
        super().__init__("uncom_monitor", **node_options)
        self._keep_events = keep_events
        self._seen: set[str] = set()
        self._on_event = on_event
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._frames: dict[str, list[Frame]] = {"camera": [], "overview": [], "annotated": []}
        for kind, topic in _LISTENED.items():
            self._listen(kind, topic)
        if keep_events:
            self.create_subscription(
                Image, topics.ANNOTATED.name, self._keeper("annotated", FRAME.annotated_quality), 10
            )
        if keep_camera:
            self.create_subscription(Image, topics.RGB.name, self._keeper("camera", FRAME.video_quality), 10)
        if overview_topic:
            self.create_subscription(Image, overview_topic, self._keeper("overview", FRAME.video_quality), 10)

    def record(self) -> RunRecord:
        """Return everything so far."""
        with self._lock:
            return RunRecord(
                tuple(self._events),
                tuple(self._frames["camera"]),
                tuple(self._frames["overview"]),
                tuple(self._frames["annotated"]),
            )

    def missing(self) -> list[str]:
        """Return which nodes have not shown yet that they work, with what is waited for."""
        with self._lock:
            seen = set(self._seen)
        waiting = [f"{node} ({what})" for kind, (node, what) in _SIGNS.items() if kind not in seen]
        for node, topic in _LISTENERS.items():
            if all(info.node_name != node for info in self.get_subscriptions_info_by_topic(topic.name)):
                waiting.append(f"{node} (to listen to {topic.name})")
        if not any(name == DETECT_SERVICE for name, _ in self.get_service_names_and_types()):
            waiting.append(f"{DETECTION_NODE.name} (service {DETECT_SERVICE})")
        return waiting

    def graph_is_up(self) -> bool:
        """Whether all six nodes work: each has said something, or listens or serves as it should."""
        return not self.missing()

    def _listen(self, kind: str, topic: topics.Topic) -> None:
        qos = QoSProfile(depth=topic.depth)
        if topic.latched:
            qos.durability = QoSDurabilityPolicy.TRANSIENT_LOCAL

        def receive(msg: Any) -> None:
            self._add(kind, msg)

        self.create_subscription(message_class(topic.type_name), topic.name, receive, qos)

    def _add(self, kind: str, msg: Any) -> None:
        skip = () if kind == run_record.SAY else ("cloud", "mask")
        data = plain_from_msg(msg, skip)
        if kind == run_record.EXPLANATION:
            data = {**data, "json": _decoded(msg.json)}
        stamp_s = seconds_from_msg(msg.header.stamp) if hasattr(msg, "header") else 0.0
        event = Event(kind, stamp_s, 1e-9 * self.get_clock().now().nanoseconds, time.monotonic(), data)
        with self._lock:
            self._seen.add(kind)
            if self._keep_events:
                self._events.append(event)
        if self._on_event is not None:
            self._on_event(event)

    def _keeper(self, name: str, quality: int) -> Callable[[Image], None]:
        def keep(msg: Image) -> None:
            self.keep_frame(name, seconds_from_msg(msg.header.stamp), encode_jpeg(rgb_from_msg(msg), quality))

        return keep

    def keep_frame(self, name: str, stamp_s: float, jpeg: bytes) -> None:
        """Keep a picture as "camera", "overview" or "annotated", wherever it was compressed."""
        with self._lock:
            self._frames[name].append(Frame(stamp_s, time.monotonic(), jpeg))


def _decoded(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return {}
