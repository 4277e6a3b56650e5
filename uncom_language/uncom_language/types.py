# SPDX-License-Identifier: Apache-2.0
"""Values of hearing and understanding. Times are seconds of the ROS clock (or of a file, from its start)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum


@dataclass(frozen=True, slots=True)
class Word:
    """One recognised word with its own times [s] (paper, section III-B)."""

    text: str
    start_s: float
    end_s: float
    confidence: float = 1.0


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another hypothesis of the recogniser; score is its log score relative to the best one (0 or less)."""

    words: tuple[Word, ...]
    score: float

    @property
    def text(self) -> str:
        """The words as one line."""
        return " ".join(word.text for word in self.words)


@dataclass(frozen=True, slots=True)
class Transcript:
    """What was heard in one utterance."""

    utterance_id: str
    words: tuple[Word, ...]
    alternatives: tuple[Alternative, ...] = ()
    language: str = "en"
    backend: str = ""
    latency_s: float = 0.0

    @property
    def text(self) -> str:
        """The words as one line."""
        return " ".join(word.text for word in self.words)


class Act(IntEnum):
    """What an utterance does; the constants of Command.msg."""

    COMMAND = 0
    REFUSED = 1
    INCOMPLETE = 2
    YES = 3
    NO = 4
    STOP = 5
    CANCEL = 6


class Primitive(str, Enum):
    """What the robot is asked to do with the object."""

    PUT_IN = "put_in"
    PUT_ON = "put_on"
    PLACE = "place"
    STACK = "stack"
    POUR = "pour"
    PUSH = "push"
    PICK = "pick"
    GIVE = "give"
    POINT = "point"
    NONE = "none"


class Relation(str, Enum):
    """Where the object is to be with respect to the target."""

    ON = "on"
    IN = "in"
    LEFT_OF = "left_of"
    RIGHT_OF = "right_of"
    IN_FRONT_OF = "in_front_of"
    BEHIND = "behind"
    NEXT_TO = "next_to"
    NEAR = "near"
    BETWEEN = "between"
    UNDER = "under"
    ABOVE = "above"
    HERE = "here"
    THERE = "there"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time [s]."""

    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True)
class Reference:
    """A thing or place as words: no grounding. The fields are those of Reference.msg."""

    text: str
    head: str
    span: Span
    modifiers: tuple[str, ...] = ()
    concrete: bool = True
    deictic: str = ""
    deictic_span: Span | None = None
    anaphoric: bool = False
    other: bool = False
    quantity: int = 1
    order: int = 0
    anchor_relation: str = ""
    anchor: Reference | None = None


@dataclass(frozen=True, slots=True)
class Command:
    """One command as language: object, action, target (paper, section III-C)."""

    utterance_id: str
    act: Act
    text: str
    action_text: str = ""
    primitive: Primitive = Primitive.NONE
    action_span: Span | None = None
    object: Reference | None = None
    target: Reference | None = None
    reference2: Reference | None = None
    relation: Relation = Relation.NONE
    reason: str = ""
    index: int = 0
    count: int = 1
    backend: str = ""
    notes: tuple[str, ...] = field(default=())
