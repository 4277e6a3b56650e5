# SPDX-License-Identifier: Apache-2.0
"""Confirmation that nodes have processed the messages they were sent.

Every node of ours runs its callbacks one at a time, and handles one message of each topic between two checks of its
services. A request to one of its parameter services is therefore answered only after the message before it.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Collection
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node

from uncom_bringup.exceptions import GraphError
from uncom_bringup.ros.options import LOCKSTEP, LockstepOptions


class DeliveryConfirmation:
    """Counts what nodes were sent, and waits until they have processed it."""

    def __init__(
        self, node: Node, names: Collection[str], check: Callable[[], None], options: LockstepOptions = LOCKSTEP
    ) -> None:
        """Make a client for each node.

        Args:
            node: calls the services; another thread must spin it.
            names: nodes that are sent messages.
            check: raises GraphError when one of them has died; called while waiting.
            options: limits of the waits.
        """
        self._clients = {name: node.create_client(GetParameters, f"/{name}/get_parameters") for name in names}
        self._check = check
        self._timeout_s = options.answer_timeout_s
        self._sent: Counter[tuple[str, str]] = Counter()

    def missing_nodes(self) -> list[str]:
        """Return the nodes whose parameter service is not ready yet."""
        return [name for name, client in self._clients.items() if not client.service_is_ready()]

    def count_sent(self, name: str, topic: str) -> int:
        """Note that a node was sent a message; returns how many of the topic it may not have processed yet."""
        self._sent[name, topic] += 1
        return self._sent[name, topic]

    def wait_until_processed(self, *names: str, rounds: int = 0) -> None:
        """Wait until the nodes have processed what they were sent (at least `rounds` messages of each topic).

        Raises:
            GraphError: a node died or does not answer.
        """
        for name in names:
            waiting = [count for (node, _), count in self._sent.items() if node == name]
            # A node handles one message of each topic between two checks of its services.
            for _ in range(max([rounds, *waiting])):
                self.call_service(name, self._clients[name], GetParameters.Request())
            for key in [key for key in self._sent if key[0] == name]:
                del self._sent[key]

    def call_service(self, name: str, client: Any, request: Any) -> Any:
        """Call a service of a node and return its answer.

        Raises:
            GraphError: it died or does not answer.
        """
        done = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: done.set())
        deadline = time.monotonic() + self._timeout_s
        while not done.wait(0.2):
            self._check()
            if time.monotonic() > deadline:
                raise GraphError(name, f"has not answered for {self._timeout_s:.0f} s")
        return future.result()
