# SPDX-License-Identifier: Apache-2.0
"""Runs the understanding part of the graph on a bag."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import rclpy
from audio_common_msgs.msg import AudioDataStamped
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from uncom_common.conversions import seconds_from_msg, time_to_msg

from uncom_bringup import artifacts, progress, summary, topics
from uncom_bringup import run_record as kinds
from uncom_bringup.bag_reader import BagMessage, BagReader
from uncom_bringup.completion import waiting_for
from uncom_bringup.domain import DomainClaim
from uncom_bringup.exceptions import BagError, GraphError
from uncom_bringup.graph import UNDERSTANDING, GraphProcesses
from uncom_bringup.monitor_node import MonitorNode
from uncom_bringup.player_node import PlayerNode, chosen_topics, play
from uncom_bringup.report.page import Outcome
from uncom_bringup.run_record import STATUS_GROUNDED, Event, RunRecord

_START_TIMEOUT_S = 90.0
_ANSWER_TIMEOUT_S = 30.0
_HANDS_TIMEOUT_S = 5.0
_SILENCE_S = 0.05
_DEPTH_LATER_NS = 60_000_000
_NEVER_NS = 2**63
_PICTURES = (topics.RGB.name, topics.RGB.stored_name)


def check_bag(bag: BagReader) -> None:
    """Look whether a bag holds what understanding needs.

    Raises:
        BagError: it holds no sound or no pictures.
    """
    names = {topic.name for topic in bag.topics}
    if topics.AUDIO.name not in names:
        raise BagError(bag.path, f"has no {topics.AUDIO.name}; it has {', '.join(sorted(names))}")
    if not names & set(_PICTURES):
        raise BagError(bag.path, f"has neither of {', '.join(_PICTURES)}; it has {', '.join(sorted(names))}")


def understand(
    bag: BagReader, folder: Path, *, rate: float, parameter_files: Sequence[Path], say: Callable[[str], None]
) -> dict[str, Any]:
    """Play a bag to the nodes and gather what they understand; returns what `uncom understand --json` prints.

    Raises:
        GraphError: a node did not come up or died.
        BagError: the bag is damaged.
    """
    begin = time.monotonic()

    def tell(event: Event) -> None:
        words = progress.line(event)
        if words:
            say(words)

    with (
        DomainClaim(os.environ.get("ROS_DOMAIN_ID")) as claim,
        GraphProcesses(folder / "log", claim.domain, parameter_files) as graph,
    ):
        say(progress.head("starting", f"five nodes (ROS domain {claim.domain})"))
        for spec in UNDERSTANDING:
            graph.start(spec, {"use_sim_time": True})
        record = _Session(claim.domain, bag, tell).run(graph, rate, say)
    return _result(bag, folder, record, time.monotonic() - begin)


class _Session:
    """Player and monitor in one context of their own."""

    def __init__(self, domain: int, bag: BagReader, tell: Callable[[Event], None]) -> None:
        self._bag = bag
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._player = PlayerNode(chosen_topics(bag, ()), clock=True, context=self._context)
        clock = [Parameter("use_sim_time", value=True)]
        self._tell = tell
        self._hands_s = self._picture_s = 0.0
        self._due_ns = _NEVER_NS
        self._monitor = MonitorNode(self._hear, keep_camera=False, context=self._context, parameter_overrides=clock)
        self._silence = self._player.create_publisher(AudioDataStamped, topics.AUDIO.name, 500)

    def run(self, graph: GraphProcesses, rate: float, say: Callable[[str], None]) -> RunRecord:
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(self._monitor)
        thread = threading.Thread(target=self._spin, args=(executor,), daemon=True)
        thread.start()
        try:
            self._wait_until_up(graph)
            say(progress.head("playing", f"{self._bag.duration_s:.1f} s at rate {rate:g}"))
            play(self._bag, self._player, rate, self._player.published_topics, graph.check, self._wait_for_hands)
            self._wait_for_answers(graph, rate)
            return self._monitor.record()
        finally:
            executor.shutdown(timeout_sec=2.0)
            thread.join(timeout=5.0)
            self._player.destroy_node()
            self._monitor.destroy_node()
            self._context.try_shutdown()

    @staticmethod
    def _spin(executor: SingleThreadedExecutor) -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    def _wait_until_up(self, graph: GraphProcesses) -> None:
        deadline = time.monotonic() + _START_TIMEOUT_S
        needed = {"speech_node": topics.AUDIO, "gesture_node": topics.RGB, "reasoner_node": topics.COMMAND}
        while True:
            graph.check()
            missing = [n for n in self._monitor.missing() if n.startswith(("language_node", "detection_node"))]
            for node, topic in needed.items():
                if node not in {i.node_name for i in self._monitor.get_subscriptions_info_by_topic(topic.name)}:
                    missing.append(node)
            if not missing:
                return
            if time.monotonic() > deadline:
                raise GraphError(
                    "the graph", f"is not up after {_START_TIMEOUT_S:.0f} s; missing: {', '.join(missing)}"
                )
            time.sleep(0.05)

    def _wait_for_hands(self, message: BagMessage) -> None:
        """Hold time until a picture was searched for hands: on a slow machine none may be left out.

        The search needs what belongs to the picture, so a little time must pass after it: its depth comes later.
        """
        if message.time_ns > self._due_ns:
            deadline = time.monotonic() + _HANDS_TIMEOUT_S
            while self._hands_s < self._picture_s - 1e-6 and time.monotonic() < deadline:
                time.sleep(0.001)
            self._due_ns = _NEVER_NS
        if message.topic.name in _PICTURES:
            self._picture_s = self._stamp_s(message)
            self._due_ns = message.time_ns + _DEPTH_LATER_NS

    def _stamp_s(self, message: BagMessage) -> float:
        stamp = self._bag.deserialise(message).header.stamp
        return float(stamp.sec) + 1e-9 * float(stamp.nanosec)

    def _hear(self, event: Event) -> None:
        if event.kind == kinds.HANDS:
            self._hands_s = event.stamp_s
        self._tell(event)

    def _wait_for_answers(self, graph: GraphProcesses, rate: float) -> None:
        """Let time go on, in silence, until everything heard is answered: the last word needs its end."""
        last = None
        for message in self._bag.messages([topics.AUDIO.name]):
            last = message
        if last is None:
            return
        sound = deserialize_message(last.data, AudioDataStamped)
        chunk = bytes(len(sound.audio.data))
        stamp_s = end_s = seconds_from_msg(sound.header.stamp) + _SILENCE_S
        clock_s = 1e-9 * last.time_ns
        deadline = time.monotonic() + _ANSWER_TIMEOUT_S
        while time.monotonic() < deadline and waiting_for(self._monitor.record(), end_s, with_execution=False):
            graph.check()
            sound.header.stamp = time_to_msg(stamp_s)
            sound.audio.data = chunk
            self._silence.publish(sound)
            stamp_s += _SILENCE_S
            clock_s += _SILENCE_S
            self._player.tell_time(int(1e9 * max(clock_s, 1e-9 * self._bag.start_ns + self._bag.duration_s)))
            time.sleep(_SILENCE_S / rate)


def _result(bag: BagReader, folder: Path, record: RunRecord, wall_s: float) -> dict[str, Any]:
    grounded = [event.data for event in record.of(kinds.GROUNDED) if event.data["status"] == STATUS_GROUNDED]
    reason = summary.failure(record) or ""
    heard = summary.heard(record)
    times = {**summary.timings(record), "wall_total": round(wall_s, 3)}
    words = reason or progress.caption(record.of(kinds.COMMAND)[-1].data)
    outcome = Outcome(None if grounded else False, words)
    made = artifacts.write_all(folder, f"UNCOM: {bag.path.name}", record, outcome, times, heard=heard)
    nowhere = {"object": None, "target": None, "area": None}
    return {
        "heard": heard,
        "understood": summary.understood(record),
        "chosen": summary.chosen_places(grounded[-1]) if grounded else nowhere,
        "success": bool(grounded),
        "reason": reason,
        "timings_s": times,
        "backends": summary.backends(record),
        "artifacts": made,
    }
