# SPDX-License-Identifier: Apache-2.0
"""The nodes of the demo itself: monitor, recorder and the receiver of the truth, each spun by a thread."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CompressedImage
from uncom_bringup.bags.bag_writer import BagWriter
from uncom_bringup.graph.topics import RECORDED, RGB, Topic
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.monitor.run_record import Event, RunRecord
from uncom_bringup.replay.recorder_node import RecorderNode
from uncom_common.conversions import seconds_from_msg

from uncom_sim.demo.ros.demo_node import DemoNode

_OVERVIEW = "/sim/overview/image_raw"


class DemoListeners:
    """Everything of the demo that listens; nothing of it does any of the six nodes' work."""

    def __init__(self, domain: int, on_event: Callable[[Event], None], bag: Path | None, force: bool = False) -> None:
        """Make the nodes in a ROS domain and spin them; on_event gets what the monitor sees, bag records everything."""
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain)
        # Only the monitor follows /clock: every follower pays for each message.
        clock = [Parameter("use_sim_time", value=True)]
        self.monitor = MonitorNode(
            on_event,
            keep_camera=bag is None,
            overview_topic=_OVERVIEW,
            context=self._context,
            parameter_overrides=clock,
        )
        self.demo = DemoNode(context=self._context)
        self._recorder: RecorderNode | None = None
        if bag is not None:
            self._recorder = RecorderNode(
                BagWriter(bag, force=force),
                RECORDED,
                now_ns=self._now_ns,
                on_compressed=self._keep_camera,
                context=self._context,
            )
        self._executors: list[SingleThreadedExecutor] = []
        self._threads: list[threading.Thread] = []
        self._spin(self.demo)
        self._spin(self.monitor)
        if self._recorder is not None:
            self._spin(self._recorder)

    def _spin(self, node: Node) -> None:
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(node)

        def spin() -> None:
            with suppress(ExternalShutdownException):
                executor.spin()

        thread = threading.Thread(target=spin, name=node.get_name(), daemon=True)
        thread.start()
        self._executors.append(executor)
        self._threads.append(thread)

    def _now_ns(self) -> int:
        return int(self.monitor.get_clock().now().nanoseconds)

    def _keep_camera(self, topic: Topic, image: CompressedImage) -> None:
        if topic is RGB:
            self.monitor.keep_frame("camera", seconds_from_msg(image.header.stamp), bytes(image.data))

    def missing(self) -> list[str]:
        """Return what is not up yet."""
        waiting = self.monitor.missing()
        return waiting if self.demo.simulator_is_up else ["driver_node (/sim/state and /sim/start)", *waiting]

    def record(self) -> RunRecord:
        """Return what was seen so far."""
        return self.monitor.record()

    def close(self) -> None:
        """Stop listening; the bag is whole afterwards."""
        for executor in self._executors:
            executor.shutdown(timeout_sec=2.0)
        for thread in self._threads:
            thread.join(timeout=5.0)
        self._executors.clear()
        if self._recorder is not None:
            self._recorder.finish()
            self._recorder.destroy_node()
            self._recorder = None
        if self._context.ok():
            self.monitor.destroy_node()
            self.demo.destroy_node()
        self._context.try_shutdown()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop listening."""
        self.close()
