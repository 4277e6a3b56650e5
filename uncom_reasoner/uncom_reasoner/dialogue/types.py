# SPDX-License-Identifier: Apache-2.0
"""Values of a dialogue: what the robot asks, what is answered, how a question ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from uncom_language.types import Command


class QuestionKind(IntEnum):
    """What a question is about; the constants of Question.msg."""

    GROUNDING = 0
    APPROVAL = 1


class Verdict(IntEnum):
    """What an answer says; the constants of Answer.msg. UNKNOWN is never taken for yes."""

    UNKNOWN = 0
    YES = 1
    NO = 2
    CHOICE = 3


@dataclass(frozen=True, slots=True)
class Question:
    """The robot asks; `part` is what the candidates are of ("object", "target", "reference2", "perspective")."""

    id: str
    utterance_id: str
    kind: QuestionKind
    text: str
    choices: tuple[str, ...]
    candidate_ids: tuple[str, ...]
    timeout_s: float
    part: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """A person answers; choice counts from 0."""

    question_id: str
    verdict: Verdict
    choice: int = -1
    text: str = ""


class End(Enum):
    """How a question ends."""

    CHOSEN = "chosen"  # one of the candidates
    APPROVED = "approved"
    DENIED = "denied"  # a plain no
    REWORDED = "reworded"  # other words for the part, or a correction: `command`
    TIMED_OUT = "timed out"
    STOPPED = "stopped"
    DROPPED = "dropped"  # a new command came instead


@dataclass(frozen=True, slots=True)
class Ending:
    """How a question ended, with the candidate that was chosen or the command that came as the answer."""

    question: Question
    end: End
    candidate_id: str = ""
    command: Command | None = None
