# SPDX-License-Identifier: Apache-2.0
"""A node of one's own beside ours: it says aloud, as text, what the robot is about to do.

Its parameters are the fields of a frozen dataclass, its callback only delegates. Beside a running graph
(`./uncom up --sim`) run: ./uncom exec python examples/07_own_node.py
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from std_msgs.msg import String
from uncom_common.configured_node import ConfiguredNode, run_node

from uncom_interfaces.msg import GroundedCommand


@dataclass(frozen=True)
class AnnouncerConfig:
    """Parameters of announcer_node."""

    politeness: str = field(default="Attention:", metadata={"description": "what every sentence begins with"})


def announcement(politeness: str, command: GroundedCommand) -> str:
    """Return the sentence for a command; pure, so that it is tested without ROS."""
    place = f" {command.relation.replace('_', ' ')} the {command.target_text}" if command.target_text else ""
    return f"{politeness} I am going to move the {command.object_text}{place}."


class AnnouncerNode(ConfiguredNode[AnnouncerConfig]):
    """Publishes a sentence on /uncom/say for every grounded command."""

    def __init__(self, **node_options: Any) -> None:
        """Subscribe and publish; nothing waits here."""
        super().__init__("announcer_node", AnnouncerConfig, **node_options)
        self._say = self.create_publisher(String, "/uncom/say", 10)
        self.create_subscription(GroundedCommand, "/uncom/grounded_command", self._announce, 10)

    def _announce(self, command: GroundedCommand) -> None:
        if command.status == GroundedCommand.GROUNDED:
            self._say.publish(String(data=announcement(self.config.politeness, command)))


if __name__ == "__main__":
    raise SystemExit(run_node(AnnouncerNode))
