# SPDX-License-Identifier: Apache-2.0
"""Runs the understanding part of the graph on a bag: everything in it, however slow the machine."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter

from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.exceptions import BagError, GraphError
from uncom_bringup.graph import topics
from uncom_bringup.graph.node_processes import GraphProcesses, ParameterValue
from uncom_bringup.graph.node_specs import GESTURE_NODE, REASONER_NODE, UNDERSTANDING_NODES
from uncom_bringup.graph.ros_domain import DomainClaim
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.monitor.run_record import Event
from uncom_bringup.replay.player_node import PlayerNode, chosen_topics
from uncom_bringup.report import progress
from uncom_bringup.report.understanding_result import UnderstandingResult
from uncom_bringup.ros.composed_graph import ComposedGraph
from uncom_bringup.ros.lockstep import Lockstep
from uncom_bringup.ros.options import LOCKSTEP

_PICTURES = (topics.RGB.name, topics.RGB.stored_name)
_DEPTHS = (topics.DEPTH.name, topics.DEPTH.stored_name)


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


def graph_parameters(bag: BagReader) -> dict[str, dict[str, ParameterValue]]:
    """Return the nodes' parameters for a bag: patience in place of the haste that a live graph needs."""
    depth = bool({topic.name for topic in bag.topics} & set(_DEPTHS))
    return {
        "": {"use_sim_time": True},
        GESTURE_NODE.name: {"use_depth": depth, "depth_wait_s": 0.0, "queue_size": 64},
        REASONER_NODE.name: {
            "use_depth": depth,
            "look_ahead": False,
            "wait_timeout_s": 20.0,
            "detect_timeout_s": 300.0,
            "question_timeout_s": 3600.0,
        },
    }


def understand(
    bag: BagReader,
    log_dir: Path,
    *,
    rate: float | None = None,
    parameter_files: Sequence[Path] = (),
    say: Callable[[str], None] = lambda _: None,
) -> UnderstandingResult:
    """Start the nodes as processes and play a bag to them; `say` gets a line for each event.

    Raises:
        GraphError: a node did not come up or died.
        BagError: the bag is damaged.
    """
    parameters = graph_parameters(bag)
    with (
        DomainClaim(os.environ.get("ROS_DOMAIN_ID")) as claim,
        GraphProcesses(log_dir, claim.domain, parameter_files) as graph,
    ):
        say(progress.head("starting", f"five nodes (ROS domain {claim.domain})"))
        for spec in UNDERSTANDING_NODES:
            graph.start(spec, {**parameters[""], **parameters.get(spec.name, {})})
        with _RecordingRun(bag, claim.domain, graph.check, say) as run:
            return run.play(rate)


def understand_in_process(
    path: Path, overrides: Mapping[str, Mapping[str, ParameterValue]] | None = None, domain: int | None = None
) -> UnderstandingResult:
    """Run the same nodes in this process on a bag: for tests and benchmarks, quicker to start.

    Args:
        path: the bag.
        overrides: parameters by node name over the usual ones (not those of the shipped files).
        domain: ROS domain id; None takes a free one.

    Raises:
        UncomError: the bag cannot be used, or a node its parameters.
    """
    with BagReader(path) as bag:
        check_bag(bag)
        parameters = graph_parameters(bag)
        for name, values in (overrides or {}).items():
            parameters[name] = {**parameters.get(name, {}), **values}
        with (
            DomainClaim(None if domain is None else str(domain)) as claim,
            ComposedGraph(claim.domain, UNDERSTANDING_NODES, parameters),
            _RecordingRun(bag, claim.domain, lambda: None, lambda _: None) as run,
        ):
            return run.play(None)


class _RecordingRun:
    """Player and monitor in one context of their own, for one bag; a context manager."""

    def __init__(self, bag: BagReader, domain: int, check: Callable[[], None], say: Callable[[str], None]) -> None:
        self._bag, self._check, self._say = bag, check, say
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._player = PlayerNode(chosen_topics(bag, ()), clock=True, context=self._context)
        clock = [Parameter("use_sim_time", value=True)]
        self._lockstep: Lockstep | None = None
        self._monitor = MonitorNode(self._on_event, keep_camera=False, context=self._context, parameter_overrides=clock)
        self._lockstep = Lockstep(bag, self._player, self._monitor, check, say)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._monitor)
        self._thread = threading.Thread(target=self._spin, name="monitor", daemon=True)

    def play(self, rate: float | None) -> UnderstandingResult:
        """Play the bag and return what was understood."""
        lockstep = self._lockstep
        assert lockstep is not None  # noqa: S101  (made in __init__)
        self._wait_until_up(lockstep)
        pace = "as fast as it is understood" if rate is None else f"at rate {rate:g}"
        self._say(progress.head("playing", f"{self._bag.duration_s:.1f} s {pace}"))
        lockstep.run(rate)
        counts = lockstep.counts
        return UnderstandingResult(self._monitor.record(), counts.pictures, counts.examined)

    def _on_event(self, event: Event) -> None:
        if self._lockstep is not None:
            self._lockstep.on_event(event)
        words = progress.line(event)
        if words:
            self._say(words)

    def _wait_until_up(self, lockstep: Lockstep) -> None:
        deadline = time.monotonic() + LOCKSTEP.start_timeout_s
        while missing := lockstep.missing_nodes():
            self._check()
            if time.monotonic() > deadline:
                raise GraphError(
                    "the graph", f"is not up after {LOCKSTEP.start_timeout_s:.0f} s; missing: {', '.join(missing)}"
                )
            time.sleep(0.05)

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=2.0)
        self._thread.join(timeout=5.0)
        self._player.destroy_node()
        self._monitor.destroy_node()
        self._context.try_shutdown()
