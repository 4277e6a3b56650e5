# SPDX-License-Identifier: Apache-2.0
"""What a session wants done: values that it returns, in the order in which they are to be carried out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from uncom_language.types import Command

from uncom_reasoner.dialogue.types import Answer, Question
from uncom_reasoner.session.task import DetectionRequest, GroundingTask
from uncom_reasoner.types import Decision, Evidence


@dataclass(frozen=True, slots=True)
class StopMotion:
    """Whatever moves is to stop at once."""


@dataclass(frozen=True, slots=True)
class DecisionDue:
    """A task has all that it needs: `Session.decide` is to be called with it, off the thread that must not wait."""

    task: GroundingTask


@dataclass(frozen=True, slots=True)
class Report:
    """One decision to be made known.

    Attributes:
        command: that was decided on.
        decision: the outcome; a group has a report for each of its objects.
        sentence: what the robot says of it; whether it is said aloud is told by `Say`.
        scene_s: stamp of the image in which objects were looked for [s]; 0 without one.
        evidence: that the decision rests on; None where nothing was looked at.
    """

    command: Command
    decision: Decision
    sentence: str
    scene_s: float = 0.0
    evidence: Evidence | None = None


@dataclass(frozen=True, slots=True)
class Say:
    """A sentence for the person."""

    text: str


@dataclass(frozen=True, slots=True)
class QuestionAsked:
    """A question was opened: about an object or place, or whether a motion may begin."""

    question: Question


@dataclass(frozen=True, slots=True)
class AnswerGiven:
    """The answer to a question of the execution node, as the person gave it."""

    answer: Answer


@dataclass(frozen=True, slots=True)
class StageTimes:
    """How long the stages of a task took on the steady clock [s], by name."""

    command: Command
    durations_s: Mapping[str, float]


Event: TypeAlias = StopMotion | DetectionRequest | DecisionDue | Report | Say | QuestionAsked | AnswerGiven | StageTimes
Events: TypeAlias = tuple[Event, ...]


def say(text: str) -> tuple[Say, ...]:
    """Return the event of a sentence; none for an empty one."""
    return (Say(text),) if text else ()
