# SPDX-License-Identifier: Apache-2.0
"""What is answered to the reasoner, and what the execution node waits for, as calls of the session."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from std_srvs.srv import SetBool

from uncom_interfaces.msg import Answer as AnswerMsg
from uncom_interfaces.msg import ExecutionStatus
from uncom_interfaces.msg import Question as QuestionMsg
from uncom_reasoner.conversions import answer_from_msg, question_from_msg
from uncom_reasoner.session.events import Events
from uncom_reasoner.session.session import Session


class DialogueIo:
    """Subscriptions and service of questions and answers; the callbacks only hand on to the session's thread."""

    def __init__(
        self,
        node: Node,
        session: Session,
        group: CallbackGroup,
        run: Callable[..., None],
        publish: Callable[[Events], None],
    ) -> None:
        """Create the subscriptions and the service.

        Args:
            node: that receives.
            session: that is told.
            group: of the callbacks.
            run: calls a method of the session on its thread and publishes what it returns.
            publish: publishes events at once.
        """
        self._session, self._run, self._publish = session, run, publish
        node.create_subscription(QuestionMsg, "/uncom/question", self._on_question, 10, callback_group=group)
        node.create_subscription(AnswerMsg, "/uncom/answer", self._on_answer, 10, callback_group=group)
        node.create_subscription(ExecutionStatus, "/uncom/execution_status", self._on_status, 10, callback_group=group)
        node.create_service(SetBool, "/uncom/approve", self._on_approve, callback_group=group)

    def _on_question(self, msg: QuestionMsg) -> None:
        if self._session.consent.is_about_consent(msg.question_id):
            self._run(self._session.consent.adopt, question_from_msg(msg))

    def _on_answer(self, msg: AnswerMsg) -> None:
        self._run(self._session.take_answer, answer_from_msg(msg))

    def _on_status(self, msg: ExecutionStatus) -> None:
        consent = self._session.consent
        if msg.stage == ExecutionStatus.AWAITING_APPROVAL:
            self._run(consent.request, msg.utterance_id, int(msg.index))
        elif msg.stage != ExecutionStatus.IDLE and consent.question is not None:
            self._run(consent.motion_went_on, msg.utterance_id, int(msg.index))

    def _on_approve(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Answer the open question of consent: data true is yes, false is no."""
        question = self._session.consent.question
        response.success = question is not None
        response.message = question.text if question is not None else "nothing waits for approval"
        self._publish(self._session.consent.answer(yes=bool(request.data), text="by service"))
        return response
