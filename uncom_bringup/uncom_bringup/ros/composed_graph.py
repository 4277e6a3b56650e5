# SPDX-License-Identifier: Apache-2.0
"""Nodes composed in one process, each spun as its own process would: for tests and benchmarks."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from uncom_bringup.graph.node_processes import ParameterValue
from uncom_bringup.graph.node_specs import SIX_NODES, NodeSpec


def node_class(spec: NodeSpec) -> Any:
    """Import the class of a node."""
    return getattr(importlib.import_module(spec.module), spec.class_name)


class ComposedGraph:
    """Several nodes in one context of its own, each spun by a thread of its own until closed."""

    def __init__(
        self,
        domain: int,
        specs: Sequence[NodeSpec] = SIX_NODES,
        parameters: Mapping[str, Mapping[str, ParameterValue]] | None = None,
    ) -> None:
        """Make the nodes; `parameters` are by node name, and those under "" go to every node.

        Raises:
            UncomError: a node refuses its parameters or cannot load its back end.
        """
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.nodes: dict[str, Node] = {}
        self._executors: list[SingleThreadedExecutor] = []
        self._threads: list[threading.Thread] = []
        try:
            for spec in specs:
                given = {**(parameters or {}).get("", {}), **(parameters or {}).get(spec.name, {})}
                overrides = [Parameter(name, value=value) for name, value in given.items()]
                self.add(node_class(spec)(context=self.context, parameter_overrides=overrides))
        except BaseException:
            self.close()
            raise

    def add(self, node: Node) -> None:
        """Spin another node of the same context, too."""
        self.nodes[node.get_name()] = node
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(node)
        self._executors.append(executor)

    def start(self) -> Self:
        """Begin to spin."""
        for executor in self._executors[len(self._threads) :]:
            thread = threading.Thread(target=_spin, args=(executor,), name="composed graph", daemon=True)
            thread.start()
            self._threads.append(thread)
        return self

    def close(self) -> None:
        """Stop spinning and destroy the nodes."""
        for executor in self._executors:
            executor.shutdown(timeout_sec=2.0)
        for thread in self._threads:
            thread.join(timeout=5.0)
        for node in self.nodes.values():
            node.destroy_node()
        self.nodes.clear()
        self.context.try_shutdown()

    def __enter__(self) -> Self:
        """Begin to spin."""
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop."""
        self.close()


def _spin(executor: SingleThreadedExecutor) -> None:
    with suppress(ExternalShutdownException):
        executor.spin()
