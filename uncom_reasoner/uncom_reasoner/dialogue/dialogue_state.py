# SPDX-License-Identifier: Apache-2.0
"""One question at a time: open, answered, or out of time. Time is passed in; nothing waits.

Only a plain yes approves a motion. What is not understood leaves the question open (and is said once); silence ends
it without any effect.
"""

from __future__ import annotations

from uncom_language.types import Act, Command

from uncom_reasoner.dialogue.answers import find_choice
from uncom_reasoner.dialogue.options import CONVERSATION, ConversationOptions
from uncom_reasoner.dialogue.types import Answer, End, Ending, Question, QuestionKind, Verdict


class Dialogue:
    """The state: no question, or one that is open until `deadline_s`; all times are on the caller's clock [s]."""

    def __init__(self, options: ConversationOptions = CONVERSATION) -> None:
        """Start with no question; options tell how often one is said again."""
        self._max_reminders = options.max_reminders
        self.question: Question | None = None
        self.asked_s = 0.0
        self._reminders = 0

    @property
    def deadline_s(self) -> float:
        """When the open question ends by itself; infinite without one."""
        return self.asked_s + self.question.timeout_s if self.question is not None else float("inf")

    def ask(self, question: Question, now_s: float) -> Ending | None:
        """Open a question; one that was open is dropped, and its ending is returned."""
        ending = self._end(End.DROPPED)
        self.question, self.asked_s, self._reminders = question, now_s, 0
        return ending

    def tick(self, now_s: float) -> Ending | None:
        """End the question if its time is over."""
        return self._end(End.TIMED_OUT) if now_s >= self.deadline_s else None

    def answered(self, answer: Answer) -> Ending | None:
        """Take an answer that names its question: one to another question, or to none, does nothing.

        An answer without an id counts for a question about objects, but never approves a motion.
        """
        question = self.question
        if question is None or answer.question_id not in ("", question.id):
            return None
        if question.kind is QuestionKind.APPROVAL and not answer.question_id and answer.verdict is not Verdict.NO:
            return None
        if answer.verdict is Verdict.CHOICE:
            known = 0 <= answer.choice < len(question.candidate_ids)
            return self._choose(question.candidate_ids[answer.choice]) if known else None
        if answer.verdict is Verdict.UNKNOWN:
            return self._choose(find_choice(answer.text, question))
        return self._decide(yes=answer.verdict is Verdict.YES)

    def heard(self, command: Command) -> Ending | None:
        """Take what a person said while the question is open; None: it stays open (see `reminder`)."""
        question = self.question
        if question is None:
            return None
        if command.act in (Act.STOP, Act.CANCEL):
            return self._end(End.STOPPED)
        if command.act is Act.COMMAND:
            return self._end(End.DROPPED, command=command)
        if command.act in (Act.YES, Act.NO):
            return self._decide(yes=command.act is Act.YES)
        return self._take_words(command, question)

    def _take_words(self, command: Command, question: Question) -> Ending | None:
        """Take words that are neither yes nor no: one of the choices, or a part said in another way."""
        named = find_choice(command.text, question) if question.kind is QuestionKind.GROUNDING else ""
        if named:
            return self._choose(named)
        # A motion that was asked about is amended by a correction only: a stray noun is no new wish.
        amends = command.act is Act.CORRECTION or question.kind is QuestionKind.GROUNDING
        if amends and _has_parts(command) and question.part != "perspective":
            return self._end(End.REWORDED, command=command)
        return None

    def pointed(self, candidate_id: str) -> Ending | None:
        """End the question with the candidate that a gesture shows; a gesture never approves a motion."""
        return self._choose(candidate_id)

    def reminder(self) -> str:
        """Return what to say when an answer was not understood; "" if that was said often enough."""
        if self.question is None or self._reminders >= self._max_reminders:
            return ""
        self._reminders += 1
        if self.question.kind is QuestionKind.APPROVAL:
            return f"Please say yes or no. {self.question.text}"
        return f"I did not understand that. {self.question.text}"

    def close(self) -> None:
        """Forget the open question."""
        self.question = None

    def _decide(self, *, yes: bool) -> Ending | None:
        """Take a plain yes or no; yes to several choices says nothing."""
        question = self.question
        if question is None:
            return None
        if not yes:
            return self._end(End.DENIED)
        if question.kind is QuestionKind.APPROVAL:
            return self._end(End.APPROVED)
        return self._choose(question.candidate_ids[0]) if len(question.candidate_ids) == 1 else None

    def _choose(self, candidate_id: str) -> Ending | None:
        """End a question about objects with one of them; never a question whether to move."""
        question = self.question
        if question is None or question.kind is QuestionKind.APPROVAL or candidate_id not in question.candidate_ids:
            return None
        return self._end(End.CHOSEN, candidate_id)

    def _end(self, end: End, candidate_id: str = "", command: Command | None = None) -> Ending | None:
        question, self.question = self.question, None
        return Ending(question, end, candidate_id, command) if question is not None else None


def _has_parts(command: Command) -> bool:
    return command.object is not None or command.target is not None or command.distance_m > 0.0
