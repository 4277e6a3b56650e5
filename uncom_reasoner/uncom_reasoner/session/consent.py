# SPDX-License-Identifier: Apache-2.0
"""The consent that a motion needs.

The gate is the execution node's: it says AWAITING_APPROVAL and moves only after an Answer YES with the id
`approve-<utterance_id>-<index>`. Here that question is put to the person once, and a spoken yes or no, or an answer by
service, becomes the answer.
"""

from __future__ import annotations

from dataclasses import replace

from uncom_language.types import Act, Command

from uncom_reasoner.dialogue.dialogue_state import Dialogue
from uncom_reasoner.dialogue.types import Answer, End, Ending, Question, QuestionKind, Verdict
from uncom_reasoner.session.clock import Clock
from uncom_reasoner.session.events import AnswerGiven, Events, QuestionAsked, say
from uncom_reasoner.session.options import SESSION, SessionOptions

_PREFIX = "approve-"


class ConsentGate:
    """The question whether a motion may begin: put, answered, or out of time."""

    def __init__(self, clock: Clock, timeout_s: float, options: SessionOptions = SESSION) -> None:
        """Start with no question.

        Args:
            clock: of the session.
            timeout_s: how long the question stays open where the execution node does not say [s].
            options: how much is remembered.
        """
        self._clock, self._timeout_s, self._options = clock, timeout_s, options
        self._dialogue = Dialogue()
        self._put_here: set[str] = set()  # ids of the questions that were put here
        self._proposals: dict[str, str] = {}  # question id -> what would be done

    @property
    def question(self) -> Question | None:
        """The open question; None: no motion waits for consent."""
        return self._dialogue.question

    @staticmethod
    def is_about_consent(question_id: str) -> bool:
        """Whether a question with this id asks whether a motion may begin."""
        return question_id.startswith(_PREFIX)

    def expect(self, utterance_id: str, index: int, proposal: str) -> None:
        """Remember what a command would do, for the question whether it may be done."""
        self._proposals[_question_id(utterance_id, index)] = proposal
        while len(self._proposals) > self._options.remembered_proposals:
            self._proposals.pop(next(iter(self._proposals)))
        if len(self._put_here) > self._options.remembered_consents:
            self._put_here.clear()

    def request(self, utterance_id: str, index: int) -> Events:
        """Put the question for a motion that waits, unless it is open already."""
        name = _question_id(utterance_id, index)
        if self.question is not None and self.question.id == name:
            return ()
        self._put_here.add(name)
        text = self._proposals.get(name, "May I move?")
        question = Question(name, utterance_id, QuestionKind.APPROVAL, text, ("yes", "no"), (), self._timeout_s)
        return (QuestionAsked(question), *self._open(question))

    def adopt(self, question: Question) -> Events:
        """Take over a question that the execution node has put itself."""
        if not self.is_about_consent(question.id) or question.id in self._put_here:
            return ()
        return self._open(
            replace(
                question,
                kind=QuestionKind.APPROVAL,
                choices=("yes", "no"),
                candidate_ids=(),
                timeout_s=question.timeout_s or self._timeout_s,
            )
        )

    def _open(self, question: Question) -> Events:
        self._dialogue.ask(question, self._clock.steady_s())
        return say(question.text)

    def motion_went_on(self, utterance_id: str, index: int) -> Events:
        """Close the question of a motion that the execution node began or gave up, whoever answered."""
        if self.question is not None and self.question.id == _question_id(utterance_id, index):
            self._dialogue.close()
        return ()

    def answered(self, answer: Answer) -> None:
        """Take an answer that the execution node heard too; here the question ends."""
        self._dialogue.answered(answer)

    def answer(self, *, yes: bool, text: str) -> Events:
        """Answer the open question otherwise than by speech; nothing happens without one."""
        if self.question is None:
            return ()
        return (AnswerGiven(Answer(self.question.id, Verdict.YES if yes else Verdict.NO, text=text)),)

    def hear(self, command: Command) -> Events:
        """Take what was said while a motion waits: yes, no, stop and another command end the question."""
        ending = self._dialogue.heard(command)
        if ending is not None:
            return _answers(ending)
        if self.question is not None and command.act is not Act.COMMAND:
            return say(self._dialogue.reminder())
        return ()

    def check_time(self) -> Events:
        """End the question when its time is over."""
        ending = self._dialogue.tick(self._clock.steady_s())
        return () if ending is None else _answers(ending)


def _question_id(utterance_id: str, index: int) -> str:
    return f"{_PREFIX}{utterance_id}-{index}"


def _answers(ending: Ending) -> Events:
    """Answer the execution node: yes only for a plain yes, no for everything else that ended the question."""
    verdict = Verdict.YES if ending.end is End.APPROVED else Verdict.NO
    return (AnswerGiven(Answer(ending.question.id, verdict, text=ending.end.value)),)
