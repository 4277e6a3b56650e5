# SPDX-License-Identifier: Apache-2.0
"""The reasoner's voice: questions out, answers in, and the consent that a motion needs.

The gate is the execution node's: it says AWAITING_APPROVAL and moves only after an Answer YES with the id
`approve-<utterance_id>-<index>`. Here that question is put to the person once, and a spoken yes or no, or the service
/uncom/approve, becomes the answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool
from uncom_common.conversions import header_to_msg
from uncom_language.types import Act, Command

from uncom_interfaces.msg import Answer as AnswerMsg
from uncom_interfaces.msg import ExecutionStatus
from uncom_interfaces.msg import Question as QuestionMsg
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.conversions import answer_from_msg, answer_to_msg, question_from_msg, question_to_msg
from uncom_reasoner.dialogue.machine import Dialogue
from uncom_reasoner.dialogue.types import Answer, End, Ending, Question, QuestionKind, Verdict

APPROVE = "approve-"


class Asking:
    """Topics and service of the dialogue; the callbacks only pass on to `run` (the worker's queue)."""

    def __init__(
        self,
        node: Node,
        config: ReasonerConfig,
        group: CallbackGroup,
        run: Callable[..., None],
        answered: Callable[[Answer], None],
    ) -> None:
        """Connect; `answered` gets the answers that are not about approval."""
        self._node, self._config, self._run, self._answered = node, config, run, answered
        self._approval = Dialogue()
        self._asked_by_me: set[str] = set()
        self._sentences: dict[str, str] = {}  # question id -> what would be done
        self._question = node.create_publisher(QuestionMsg, "/uncom/question", 10)
        self._answer = node.create_publisher(AnswerMsg, "/uncom/answer", 10)
        self._say = node.create_publisher(String, "/uncom/say", 10)
        node.create_subscription(QuestionMsg, "/uncom/question", self._on_question, 10, callback_group=group)
        node.create_subscription(AnswerMsg, "/uncom/answer", self._on_answer, 10, callback_group=group)
        node.create_subscription(ExecutionStatus, "/uncom/execution_status", self._on_status, 10, callback_group=group)
        node.create_service(SetBool, "/uncom/approve", self._on_approve, callback_group=group)

    # --- what comes in -------------------------------------------------------------------------------

    def _on_question(self, msg: QuestionMsg) -> None:
        """Adopt an approval question that the execution node has put itself."""
        if msg.question_id.startswith(APPROVE):
            self._run(self._adopt, msg)

    def _adopt(self, msg: QuestionMsg) -> None:
        if msg.question_id in self._asked_by_me:
            return
        question = question_from_msg(msg)
        self._open(Question(
            question.id, question.utterance_id, QuestionKind.APPROVAL, question.text, ("yes", "no"), (),
            question.timeout_s or self._config.approval_timeout_s,
        ))  # fmt: skip

    def _on_status(self, msg: ExecutionStatus) -> None:
        if msg.stage == ExecutionStatus.AWAITING_APPROVAL:
            self._run(self._ask_approval, msg.utterance_id, int(msg.index))
        elif msg.stage != ExecutionStatus.IDLE and self._approval.question is not None:
            self._run(self._over, msg.utterance_id, int(msg.index))

    def _on_answer(self, msg: AnswerMsg) -> None:
        self._run(self._take_answer, answer_from_msg(msg))

    def _on_approve(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Answer the open approval question: data true is yes, false is no."""
        question = self._approval.question
        response.success = question is not None
        response.message = question.text if question is not None else "nothing waits for approval"
        if question is not None:
            verdict = Verdict.YES if request.data else Verdict.NO
            self.answer(Answer(question.id, verdict, text="by service"))
        return response

    # --- on the worker -------------------------------------------------------------------------------

    def _ask_approval(self, utterance_id: str, index: int) -> None:
        name = f"{APPROVE}{utterance_id}-{index}"
        if self._approval.question is not None and self._approval.question.id == name:
            return
        self._asked_by_me.add(name)
        text = self._sentences.get(name, "May I move?")
        question = Question(
            name, utterance_id, QuestionKind.APPROVAL, text, ("yes", "no"), (), self._config.approval_timeout_s
        )
        self.ask(question)
        self._open(question)

    def _open(self, question: Question) -> None:
        self._approval.ask(question, self.now_s())
        self.say(question.text)

    def _over(self, utterance_id: str, index: int) -> None:
        """The execution node went on, whoever approved or denied."""
        question = self._approval.question
        if question is not None and question.id == f"{APPROVE}{utterance_id}-{index}":
            self._approval.close()

    def _take_answer(self, answer: Answer) -> None:
        if answer.question_id.startswith(APPROVE):
            self._approval.answered(answer)  # the execution node heard it too; here the question ends
        else:
            self._answered(answer)

    def heard(self, command: Command) -> Ending | None:
        """Take what was said while a motion waits for approval; returns how that question ended, if it did."""
        ending = self._approval.heard(command)
        if ending is not None:
            self._tell(ending)
        elif self._approval.question is not None and command.act is not Act.COMMAND:
            self.say(self._approval.reminder())
        return ending

    def tick(self) -> None:
        """End the approval question when its time is over."""
        ending = self._approval.tick(self.now_s())
        if ending is not None:
            self._tell(ending)

    def _tell(self, ending: Ending) -> None:
        """Answer the execution node: yes only for a plain yes, no for everything else that ended the question."""
        yes = ending.end is End.APPROVED
        self.answer(Answer(ending.question.id, Verdict.YES if yes else Verdict.NO, text=ending.end.value))

    @property
    def waiting(self) -> bool:
        """Whether a motion waits for approval."""
        return self._approval.question is not None

    # --- what goes out -------------------------------------------------------------------------------

    def plan(self, utterance_id: str, index: int, words: str) -> None:
        """Remember what a command would do, for the question whether it may be done."""
        self._sentences[f"{APPROVE}{utterance_id}-{index}"] = words
        while len(self._sentences) > 20:
            self._sentences.pop(next(iter(self._sentences)))
        if len(self._asked_by_me) > 50:
            self._asked_by_me.clear()

    def ask(self, question: Question) -> None:
        """Publish a question."""
        header = header_to_msg(self.ros_now_s(), self._config.base_frame)
        self._question.publish(question_to_msg(question, header))

    def answer(self, answer: Answer) -> None:
        """Publish an answer."""
        self._answer.publish(answer_to_msg(answer, header_to_msg(self.ros_now_s(), self._config.base_frame)))

    def say(self, words: str) -> None:
        """Say something, if there is anything to say."""
        if words:
            self._say.publish(String(data=words))

    def ros_now_s(self) -> float:
        """Return the time of the node's clock [s]."""
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def now_s(self) -> float:
        """Return a time [s] for time-outs: of the wall, since a bag's clock may stand still for ever."""
        return time.monotonic()
