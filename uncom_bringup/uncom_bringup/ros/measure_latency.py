# SPDX-License-Identifier: Apache-2.0
"""`uncom bench latency`: bags played at the pace of the clock into the nodes, and how long each answer takes.

The time counts from the end of the last word, as the recogniser stamps it, to /uncom/grounded_command, on the wall;
stages are what passes between the topics on the way.
"""

from __future__ import annotations

import math
import os
import statistics
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter

from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.exceptions import GraphError
from uncom_bringup.graph.node_processes import GraphProcesses
from uncom_bringup.graph.node_specs import UNDERSTANDING_NODES
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.monitor.run_record import Event
from uncom_bringup.replay.playback_clock import Playback, prefetch
from uncom_bringup.replay.player_node import PlayerNode, PreparedMessage, chosen_topics
from uncom_bringup.ros.options import LATENCY

STAGES = ("speech", "language", "deciding", "all")


@dataclass(frozen=True, slots=True)
class Answer:
    """One command: the bag, what was said, and the wall time of each stage [s]."""

    bag: str
    text: str
    status: int
    stages_s: dict[str, float]


def measure(bags: Sequence[Path], folder: Path, parameter_files: Sequence[Path], say: Callable[[str], None]) -> Any:
    """Play bags one after the other and return the figures as JSON values.

    Raises:
        GraphError: a node did not come up or died.
        BagError: a bag is damaged.
    """
    with (
        DomainClaim(os.environ.get("ROS_DOMAIN_ID")) as claim,
        GraphProcesses(folder / "log", claim.domain, parameter_files) as graph,
    ):
        for spec in UNDERSTANDING_NODES:
            graph.start(spec, {"use_sim_time": True})
        run = _LatencyRun(claim.domain, graph, say)
        try:
            run.wait_until_up()
            answers = list(run.play(bags[0])) if bags else []
            before = _memory_mb()  # once everything is loaded and the buffers have been filled
            answers += [answer for path in bags[1:] for answer in run.play(path)]
            after = _memory_mb()
        finally:
            run.close()
    return report_of(answers, before, after)


def report_of(answers: Sequence[Answer], before_mb: float, after_mb: float) -> dict[str, Any]:
    """Return median, 95 % and worst of every stage, and the memory of the nodes after the first bag and the last."""
    found: dict[str, Any] = {}
    for stage in STAGES:
        values = sorted(answer.stages_s[stage] for answer in answers)
        if values:
            p95 = values[max(0, math.ceil(0.95 * len(values)) - 1)]
            found[stage] = {
                "median": round(statistics.median(values), 3),
                "p95": round(p95, 3),
                "worst": round(values[-1], 3),
            }
    return {
        "commands": len(answers),
        "stages_s": found,
        "memory_mb": {"before": round(before_mb, 1), "after": round(after_mb, 1)},
        "answers": [
            {"bag": a.bag, "said": a.text, "status": a.status, **{k: round(v, 3) for k, v in a.stages_s.items()}}
            for a in answers
        ],
    }


def _memory_mb() -> float:
    """Return the memory that the nodes hold [MB]."""
    total = 0
    for child in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            total += int(child.memory_info().rss)
    return total / 1e6


class _LatencyRun:
    """Player and monitor in one context of their own."""

    def __init__(self, domain: int, graph: GraphProcesses, say: Callable[[str], None]) -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._graph, self._say = graph, say
        self._events: list[Event] = []
        self._changed = threading.Condition()
        clock = [Parameter("use_sim_time", value=True)]
        self._monitor = MonitorNode(
            self._on_event, keep_camera=False, keep_events=False, context=self._context, parameter_overrides=clock
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._monitor)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()

    def _on_event(self, event: Event) -> None:
        with self._changed:
            self._events.append(event)
            self._changed.notify_all()

    def close(self) -> None:
        self._executor.shutdown(timeout_sec=2.0)
        self._thread.join(timeout=5.0)
        self._monitor.destroy_node()
        self._context.try_shutdown()

    def wait_until_up(self) -> None:
        wanted = {spec.name for spec in UNDERSTANDING_NODES}
        deadline = time.monotonic() + LATENCY.start_timeout_s
        while missing := wanted - {name for name, _ in self._monitor.get_node_names_and_namespaces()}:
            self._graph.check()
            if time.monotonic() > deadline:
                raise GraphError(", ".join(sorted(missing)), f"did not come up in {LATENCY.start_timeout_s:.0f} s")
            time.sleep(0.1)

    def play(self, path: Path) -> Iterator[Answer]:
        """Play a bag at the pace of the clock, and yield what was answered."""
        with BagReader(path) as bag:
            player = PlayerNode(chosen_topics(bag, ()), clock=True, context=self._context)
            try:
                self._wait_for_subscribers(player)
                with self._changed:
                    self._events.clear()
                start_s, start_ns = time.monotonic(), bag.start_ns
                prepared = (player.prepare(message) for message in bag.messages(player.published_topics))
                playback: Playback[PreparedMessage] = Playback(player.send, player.tell_time)
                playback.play(prefetch(prepared), start_ns, 1.0)
                self._await_answers(player, start_s, start_ns)
            finally:
                player.destroy_node()
            for answer in self._answers(path.stem, start_s - 1e-9 * start_ns):
                self._say(f"{answer.bag}: {answer.stages_s['all']:.2f} s  {answer.text}")
                yield answer

    def _wait_for_subscribers(self, player: PlayerNode) -> None:
        deadline = time.monotonic() + LATENCY.subscribers_timeout_s
        while time.monotonic() < deadline:
            if player.count_subscribers("/audio") and player.count_subscribers("/uncom/hands"):
                break
            time.sleep(0.05)
        time.sleep(LATENCY.discovery_s)  # discovery is mutual, and only one side of it can be seen here

    def _await_answers(self, player: PlayerNode, start_s: float, start_ns: int) -> None:
        """Let time go on until every command has its decision, or for a while."""
        deadline = time.monotonic() + LATENCY.answer_timeout_s
        while time.monotonic() < deadline and not self._complete():
            player.tell_time(start_ns + int(1e9 * (time.monotonic() - start_s)))
            self._graph.check()
            with self._changed:
                self._changed.wait(0.02)

    def _complete(self) -> bool:
        with self._changed:
            keys = {(e.data["utterance_id"], e.data["index"]) for e in self._events if e.kind == run_record.COMMAND}
            done = {(e.data["utterance_id"], e.data["index"]) for e in self._events if e.kind == run_record.GROUNDED}
        return bool(keys) and keys <= done

    def _answers(self, bag: str, offset_s: float) -> Iterator[Answer]:
        """Yield the answers of a bag; offset_s takes a stamp to the wall's clock."""
        with self._changed:
            events = list(self._events)
        first: dict[tuple[str, Any], Event] = {}
        for event in events:
            if event.kind == run_record.TRANSCRIPT:
                first.setdefault((run_record.TRANSCRIPT, event.data["utterance_id"]), event)
            elif event.kind in (run_record.COMMAND, run_record.GROUNDED):
                first.setdefault((event.kind, (event.data["utterance_id"], event.data["index"])), event)
        for (kind, key), grounded in first.items():
            heard = first.get((run_record.TRANSCRIPT, key[0])) if kind == run_record.GROUNDED else None
            command = first.get((run_record.COMMAND, key)) if kind == run_record.GROUNDED else None
            if heard is None or command is None:
                continue
            spoken_s = heard.stamp_s + offset_s
            yield Answer(
                bag,
                str(command.data["text"]),
                int(grounded.data["status"]),
                {
                    "speech": heard.wall_s - spoken_s,
                    "language": command.wall_s - heard.wall_s,
                    "deciding": grounded.wall_s - command.wall_s,
                    "all": grounded.wall_s - spoken_s,
                },
            )
