# SPDX-License-Identifier: Apache-2.0
"""What a session tells, as messages: decisions, explanations, pictures, sentences, questions, answers, stop."""

from __future__ import annotations

from dataclasses import replace

from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Empty, Header, String
from uncom_common.conversions import header_to_msg, rgb_from_msg, rgb_to_msg

from uncom_interfaces.msg import Answer as AnswerMsg
from uncom_interfaces.msg import Explanation, GroundedCommand
from uncom_interfaces.msg import Question as QuestionMsg
from uncom_reasoner.conversions import answer_to_msg, explanation_to_msg, grounded_command_to_msg, question_to_msg
from uncom_reasoner.evidence.sensor_memory import SensorMemory
from uncom_reasoner.explanation.annotated_image import annotate
from uncom_reasoner.explanation.explanation import explain
from uncom_reasoner.session.clock import Clock
from uncom_reasoner.session.events import AnswerGiven, Events, QuestionAsked, Report, Say, StageTimes, StopMotion
from uncom_reasoner.types import Decision, View
from uncom_reasoner.weights import Weights


class EventPublisher:
    """The reasoner's publishers."""

    def __init__(self, node: Node, clock: Clock, weights: Weights, memory: SensorMemory) -> None:
        """Create the publishers.

        Args:
            node: that publishes and logs.
            clock: of the stamps in the headers.
            weights: whose thresholds stand in the explanations.
            memory: of the images that are drawn on, and of the base frame.
        """
        self._clock, self._weights, self._memory = clock, weights, memory
        self._logger = node.get_logger()
        self._grounded = node.create_publisher(GroundedCommand, "/uncom/grounded_command", 10)
        self._explanation = node.create_publisher(Explanation, "/uncom/explanation", 10)
        self._annotated = node.create_publisher(Image, "/uncom/annotated", 10)
        self._question = node.create_publisher(QuestionMsg, "/uncom/question", 10)
        self._answer = node.create_publisher(AnswerMsg, "/uncom/answer", 10)
        self._say = node.create_publisher(String, "/uncom/say", 10)
        self._stop = node.create_publisher(Empty, "/uncom/stop", 10)

    def publish(self, events: Events) -> None:
        """Publish events in their order; requests to the detector and decisions that are due are left to others.

        Pictures come last: drawing takes longer than all the rest.
        """
        for event in events:
            match event:
                case StopMotion():
                    self._stop.publish(Empty())
                case Report():
                    self._publish_report(event)
                case Say(text):
                    self._say.publish(String(data=text))
                case QuestionAsked(question):
                    self._question.publish(question_to_msg(question, self._header()))
                case AnswerGiven(answer):
                    self._answer.publish(answer_to_msg(answer, self._header()))
                case StageTimes(command, durations_s):
                    times = ", ".join(f"{name} {took:.3f} s" for name, took in durations_s.items())
                    self._logger.info(f"{command.text!r}: {times}")
        for event in events:
            if isinstance(event, Report) and event.evidence is not None:
                self._publish_picture(event.decision, event.evidence.view)

    def _header(self) -> Header:
        return header_to_msg(self._clock.stamp_s(), self._memory.base_frame)

    def _publish_report(self, report: Report) -> None:
        frame_id = report.decision.grounded.frame_id or self._memory.base_frame
        grounded = replace(report.decision.grounded, stamp_s=self._clock.stamp_s(), frame_id=frame_id)
        self._grounded.publish(grounded_command_to_msg(grounded))
        decision = replace(report.decision, grounded=grounded)
        reasons = explain(report.command, decision, report.scene_s, self._weights)
        self._explanation.publish(explanation_to_msg(reasons, header_to_msg(grounded.stamp_s, frame_id)))
        self._logger.info(f"{report.command.text!r}: {grounded.status.name}: {report.sentence}")

    def _publish_picture(self, decision: Decision, view: View) -> None:
        """Publish the annotated picture of a decision, if its frames are still remembered."""
        g = decision.grounded
        object_image, target_image = (self._memory.image_at(s) for s in (g.object_frame_s, g.target_frame_s))
        if object_image is not None and target_image is not None:
            picture = annotate(rgb_from_msg(object_image), rgb_from_msg(target_image), decision, view)
            self._annotated.publish(rgb_to_msg(picture, object_image.header))
