# SPDX-License-Identifier: Apache-2.0
"""Values of hearing and understanding. Times are seconds of the ROS clock (or of a file, from its start)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum

from uncom_common.primitive import Primitive


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
    FRAGMENT = 7  # a thing or place without a verb: answers a question
    CORRECTION = 8  # amends the last command; only the changed parts are present


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
    """A thing or place as words: no grounding. The fields are those of Reference.msg.

    Attributes:
        text: words without determiner, count, locating and comparing phrase ("red mug", "second cup", "this").
        head: head noun (singular) or deictic word.
        span: time [s] of the whole phrase.
        modifiers: adjectives, classifying nouns and sides ("on the left" is "left") in spoken order. Ordinal words
            ("second") are in `text`, not here.
        concrete: True for a named, tangible thing; False for "this", "it", "red one".
        deictic, deictic_span: the pointing word ("this", "that", "here", ...) and its own time [s]; also beside a noun.
        anaphoric: "it", "them": the thing spoken of before. Where that was in the same utterance, the other fields
            are its.
        other: "the other plate".
        quantity: how many; 0 is all.
        order: place among the utterance's references.
        anchor_relation, anchor: what locates the thing; always a value of Relation, "and" for the B of between A and B.
        excluded_modifiers: words that the thing must not fit: "red" of "a cup that is not red" or of "not the red
            one", "banana" of "all the fruits except the banana".
        ordinal, ordinal_side: "the second from the left" is 2, "left"; the last is -1; 0 is none. The side (left,
            right, front, back, near, far) is empty where none was said. With a superlative among the modifiers the
            counting runs along it ("the second biggest": 2 and "biggest").
        comparison, compared_to: "the one with the same colour as this" is same_colour and "this"; values: same_* and
            other_* with colour, size, shape, material, kind; similar, different; bigger, smaller, taller, shorter;
            nearest, farthest. No anchor stands for these.
        heard: the words as they were heard where one was corrected; else empty.
    """

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
    excluded_modifiers: tuple[str, ...] = ()
    ordinal: int = 0
    ordinal_side: str = ""
    comparison: str = ""
    compared_to: Reference | None = None
    heard: str = ""


@dataclass(frozen=True, slots=True)
class Command:
    """One command as language: object, action, target (paper, section III-C).

    Attributes:
        act: COMMAND; INCOMPLETE (`reason` names the missing part, the others are present); FRAGMENT: `object` is the
            thing, or `target` and `relation` the place, that was said without a verb; CORRECTION: only what changes is
            present ("no, the green one": object; "a bit to the left": relation left_of and distance_m).
        relation: where the object is to be; with a side and no target ("to the left") it is that side of where the
            object is now.
        distance_m: how far [m], 0 where it was not said; "a bit" is 0.05.
        notes: repairs and assumptions, one line each.
    """

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
    distance_m: float = 0.0
