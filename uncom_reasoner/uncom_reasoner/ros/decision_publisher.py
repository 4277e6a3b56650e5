# SPDX-License-Identifier: Apache-2.0
"""What the reasoner publishes of a decision: the grounded command, the reasons, the picture."""

from __future__ import annotations

from dataclasses import replace

from rclpy.node import Node
from sensor_msgs.msg import Image
from uncom_common.conversions import header_to_msg, rgb_from_msg, rgb_to_msg
from uncom_language.types import Command

from uncom_interfaces.msg import Explanation, GroundedCommand
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.conversions import explanation_to_msg, grounded_command_to_msg
from uncom_reasoner.evidence.sensor_memory import Senses
from uncom_reasoner.explanation.annotated_image import annotate
from uncom_reasoner.explanation.explanation import explain
from uncom_reasoner.grounding.phrasing import sentence
from uncom_reasoner.types import Decision, View
from uncom_reasoner.weights import Weights


class Telling:
    """Publishers of decisions."""

    def __init__(self, node: Node, config: ReasonerConfig, weights: Weights, senses: Senses) -> None:
        """Connect."""
        self._node, self._config, self._weights, self._senses = node, config, weights, senses
        self._grounded = node.create_publisher(GroundedCommand, "/uncom/grounded_command", 10)
        self._explanation = node.create_publisher(Explanation, "/uncom/explanation", 10)
        self._annotated = node.create_publisher(Image, "/uncom/annotated", 10)

    def tell(self, command: Command, decision: Decision, scene_s: float) -> str:
        """Publish a decision and its reasons; returns what to say of it."""
        frame_id = decision.grounded.frame_id or self._config.base_frame
        now_s = float(self._node.get_clock().now().nanoseconds) * 1e-9
        grounded = replace(decision.grounded, stamp_s=now_s, frame_id=frame_id)
        decision = replace(decision, grounded=grounded)
        self._grounded.publish(grounded_command_to_msg(grounded))
        reasons = explain(command, decision, scene_s, self._weights)
        self._explanation.publish(explanation_to_msg(reasons, header_to_msg(grounded.stamp_s, frame_id)))
        words = sentence(command, grounded)
        self._node.get_logger().info(f"{command.text!r}: {grounded.status.name}: {words}")
        return words

    def draw(self, decision: Decision, view: View) -> None:
        """Publish the annotated picture of a decision, if its frames are still there."""
        g = decision.grounded
        first, second = (self._senses.image_at(stamp) for stamp in (g.object_frame_s, g.target_frame_s))
        if first is not None and second is not None:
            picture = annotate(rgb_from_msg(first), rgb_from_msg(second), decision, view)
            self._annotated.publish(rgb_to_msg(picture, first.header))
