# SPDX-License-Identifier: Apache-2.0
"""Which of our nodes takes which topic of a bag: known from the graph, once all that must be listening are."""

from __future__ import annotations

from collections.abc import Collection

from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.graph import topics
from uncom_bringup.graph.node_specs import DETECT_SERVICE, DETECTION_NODE, UNDERSTANDING_NODES
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.replay.player_node import PlayerNode

NODES = tuple(spec.name for spec in UNDERSTANDING_NODES)


class Takers:
    """Nodes and the topics of a bag that they take; a topic's image may be taken as stored or as it is unpacked."""

    def __init__(self, bag: BagReader, player: PlayerNode, monitor: MonitorNode) -> None:
        """Look at the graph through the monitor."""
        self._stored = {topic.name for topic in bag.topics}
        self._player, self._monitor = player, monitor
        self._of: dict[str, tuple[str, ...]] = {}

    def missing(self) -> set[str]:
        """Return the nodes that do not listen yet to all that they will be told, or do not serve."""
        missing = set()
        for spec in UNDERSTANDING_NODES:
            for topic in spec.inputs:
                # A bag need not have all topics; what our own nodes say is not in it and is waited for all the same.
                if topic.role is topics.Role.SENSE and not self._stored & {topic.name, topic.stored_name}:
                    continue
                infos = self._monitor.get_subscriptions_info_by_topic(topic.name)
                if all(info.node_name != spec.name for info in infos):
                    missing.add(spec.name)
        if not any(name == DETECT_SERVICE for name, _ in self._monitor.get_service_names_and_types()):
            missing.add(DETECTION_NODE.name)
        return missing

    def find(self) -> list[str]:
        """Find out who takes what; returns the topics of the bag that anybody takes."""
        names = self._player.published_topics
        self._of = {name: tuple(node for node in NODES if node in self.listeners(name)) for name in names}
        return [name for name, nodes in self._of.items() if nodes]

    def of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that take a topic."""
        return self._of.get(topic, ())

    def takes(self, node: str, names: Collection[str]) -> bool:
        """Tell whether a node takes any of the topics."""
        return any(node in self.of(name) for name in names)

    def listeners(self, topic: str) -> list[str]:
        """Return the nodes that listen to a topic of the bag or its plain images; one that does twice, twice."""
        names = (topic, *self._player.image_topic(topic))
        return [info.node_name for name in names for info in self._monitor.get_subscriptions_info_by_topic(name)]
