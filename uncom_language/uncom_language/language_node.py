# SPDX-License-Identifier: Apache-2.0
"""language_node: /uncom/transcript in, /uncom/command out."""

from __future__ import annotations

import sys
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import seconds_from_msg

from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.msg import Transcript as TranscriptMsg
from uncom_interfaces.msg import Vocabulary as VocabularyMsg
from uncom_language.back_end_factory import understanding_from_config
from uncom_language.config import LanguageConfig
from uncom_language.conversions import command_to_msg, transcript_from_msg


class LanguageNode(ConfiguredNode[LanguageConfig]):
    """Turns every transcript into commands; one message a command or dialogue act."""

    def __init__(self, **node_options: Any) -> None:
        """Load the language pack and declare topics.

        Raises:
            UnknownBackendError: the parameter `backend` names none that works.
            UnknownLanguageError: there is no such language pack.
        """
        super().__init__("language_node", LanguageConfig, **node_options)
        self._understanding = understanding_from_config(self.config)
        self.get_logger().info(f"understanding with {self._understanding.backend}")
        self._commands = self.create_publisher(CommandMsg, "/uncom/command", 10)
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(VocabularyMsg, "/uncom/vocabulary", self._on_vocabulary, latched)
        self.create_subscription(TranscriptMsg, "/uncom/transcript", self._on_transcript, 10)

    def _on_vocabulary(self, msg: VocabularyMsg) -> None:
        self._understanding.add_vocabulary(msg.words)

    def _on_transcript(self, msg: TranscriptMsg) -> None:
        stamp_s = seconds_from_msg(msg.header.stamp)
        for command in self._understanding.understand(transcript_from_msg(msg)):
            for note in command.notes:
                self.get_logger().info(note)
            self.get_logger().info(f"{command.act.name.lower()}: {command.reason or command.text}")
            self._commands.publish(command_to_msg(command, stamp_s))


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(LanguageNode, args))


if __name__ == "__main__":
    main()
