# SPDX-License-Identifier: Apache-2.0
"""One command on its way through a session."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from uncom_language.types import Command
from uncom_perception.types import Scene

from uncom_reasoner.evidence.frame_buffer import SceneFrame
from uncom_reasoner.evidence.gesture_timing import words_span
from uncom_reasoner.session.options import SESSION, SessionOptions
from uncom_reasoner.types import Given


class TaskStage(Enum):
    """What a task waits for."""

    FRAME = "frame"  # an image to look for objects in
    DETECTION = "detection"  # the detector's answer
    HANDS = "hands"  # hands up to the end of its words
    DECISION = "decision"


@dataclass(frozen=True, slots=True)
class DetectionRequest:
    """A question to the detector: which objects are in the image of a time, and how well each phrase fits them.

    Attributes:
        frame: stamp of the image, and whether hands are in it, which are then no objects.
        phrases: noun phrases to be scored.
    """

    frame: SceneFrame
    phrases: tuple[str, ...]


@dataclass
class GroundingTask:
    """A command being grounded.

    Attributes:
        command: as it was said, or amended.
        received_s: when it came, on the clock of the stamps [s].
        received_steady_s: the same on the steady clock [s].
        given: what is settled already.
        questions_asked: how many questions about it were asked before.
        stage: what it waits for.
        request: what the detector was asked for; `requested_steady_s` is when [s].
        scene: the detector's answer.
        hands_until_s: hands after this time are not used [s].
        durations_s: how long each stage took [s], by name.
    """

    command: Command
    received_s: float
    received_steady_s: float
    given: Given = field(default_factory=Given)
    questions_asked: int = 0
    stage: TaskStage = TaskStage.FRAME
    request: DetectionRequest | None = None
    requested_steady_s: float = 0.0
    scene: Scene | None = None
    hands_until_s: float = float("inf")
    durations_s: dict[str, float] = field(default_factory=dict)

    def is_out_of_time(
        self, now_s: float, steady_s: float, late_s: float, limit_s: float, options: SessionOptions = SESSION
    ) -> bool:
        """Whether hands and images were waited for long enough.

        Args:
            now_s: time on the clock of the stamps [s].
            steady_s: time on the steady clock [s].
            late_s: how long a late gesture is waited for after the last word [s].
            limit_s: longest further wait [s]; on the steady clock it counts `options.steady_wait_factor` times.
            options: of the session.
        """
        needed_s = words_span(self.command).end_s + late_s
        return (
            now_s >= max(needed_s, self.received_s) + limit_s
            or steady_s >= self.received_steady_s + options.steady_wait_factor * limit_s
        )
