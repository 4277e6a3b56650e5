# SPDX-License-Identifier: Apache-2.0
"""Which of our nodes subscribes to which topic of a bag, as discovery shows it once all nodes are up."""

from __future__ import annotations

from collections.abc import Collection

from uncom_bringup.bags.bag_reader import BagReader
from uncom_bringup.graph import topics
from uncom_bringup.graph.node_specs import DETECT_SERVICE, DETECTION_NODE, UNDERSTANDING_NODES
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.replay.player_node import PlayerNode

NODES = tuple(spec.name for spec in UNDERSTANDING_NODES)


class TopicSubscribers:
    """Nodes and the topics of a bag that they subscribe to; an image topic counts as stored and as it is unpacked."""

    def __init__(self, bag: BagReader, player: PlayerNode, monitor: MonitorNode) -> None:
        """Read the topics of the bag; subscriptions are looked up through the monitor, as it discovers them."""
        self._stored = {topic.name for topic in bag.topics}
        self._player, self._monitor = player, monitor
        self._nodes_by_topic: dict[str, tuple[str, ...]] = {}

    def missing_nodes(self) -> set[str]:
        """Return the nodes that do not subscribe to all their inputs yet, or do not offer their service."""
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
        """Look up the subscribers of every topic; returns the topics of the bag that have any."""
        names = self._player.published_topics
        self._nodes_by_topic = {name: tuple(node for node in NODES if node in self.subscribers(name)) for name in names}
        return [name for name, nodes in self._nodes_by_topic.items() if nodes]

    def nodes_of(self, topic: str) -> tuple[str, ...]:
        """Return the nodes that subscribe to a topic."""
        return self._nodes_by_topic.get(topic, ())

    def subscribes(self, node: str, names: Collection[str]) -> bool:
        """Tell whether a node subscribes to any of the topics."""
        return any(node in self.nodes_of(name) for name in names)

    def subscribers(self, topic: str) -> list[str]:
        """Return the names of subscribers of a topic of the bag or of its plain images, once for each subscription."""
        names = (topic, *self._player.image_topic(topic))
        return [info.node_name for name in names for info in self._monitor.get_subscriptions_info_by_topic(name)]
