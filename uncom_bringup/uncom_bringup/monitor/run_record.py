# SPDX-License-Identifier: Apache-2.0
"""What was seen of one run: frozen values for the report, without ROS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

TRANSCRIPT = "transcript"
SPEECH_STATUS = "speech_status"
COMMAND = "command"
HANDS = "hands"
GROUNDED = "grounded_command"
EXPLANATION = "explanation"
EXECUTION = "execution_status"
SAY = "say"
QUESTION = "question"

# Constants of the messages.
ACT_COMMAND = 0
ACT_NAMES = ("command", "refused", "incomplete", "yes", "no", "stop", "cancel", "fragment", "correction")
PRIMITIVE_NAMES = ("none", "put_in", "put_on", "place", "stack", "pour", "push", "pick", "give", "point")
STATUS_GROUNDED, STATUS_FAILED, STATUS_AMBIGUOUS = 0, 1, 2
STATUS_NAMES = ("grounded", "failed", "ambiguous", "cancelled")
TARGET_NONE, TARGET_OBJECT, TARGET_AREA = 0, 1, 2
STAGE_IDLE, STAGE_DONE, STAGE_FAILED, STAGE_STOPPED = 0, 11, 12, 13
SPEECH_IDLE, SPEECH_RECOGNISING = 0, 2


def name_of(names: Sequence[str], number: int) -> str:
    """Return the name of a constant, or its number where a message of a later version holds one without a name."""
    return names[number] if number < len(names) else str(number)


@dataclass(frozen=True, slots=True)
class Event:
    """One message of the graph as plain values (dicts, lists, numbers).

    stamp_s is the message's own stamp (0 without header); clock_s and wall_s are ROS time and wall time of receiving.
    """

    kind: str
    stamp_s: float
    clock_s: float
    wall_s: float
    data: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Frame:
    """One camera image as JPEG."""

    stamp_s: float
    wall_s: float
    jpeg: bytes


@dataclass(frozen=True, slots=True)
class RunRecord:
    """Everything seen of a run, in order of receiving."""

    events: tuple[Event, ...] = ()
    camera: tuple[Frame, ...] = ()
    overview: tuple[Frame, ...] = ()
    annotated: tuple[Frame, ...] = ()

    def of(self, kind: str) -> tuple[Event, ...]:
        """Return the events of one kind."""
        return tuple(event for event in self.events if event.kind == kind)

    def last(self, kind: str) -> Event | None:
        """Return the last event of one kind."""
        return next((event for event in reversed(self.events) if event.kind == kind), None)

    def explanation_of(self, utterance_id: str, index: int) -> Mapping[str, Any] | None:
        """Return the decoded explanation of one command."""
        for event in reversed(self.of(EXPLANATION)):
            if event.data["utterance_id"] == utterance_id and event.data["index"] == index:
                found = event.data["json"]
                return found if isinstance(found, Mapping) else None
        return None
