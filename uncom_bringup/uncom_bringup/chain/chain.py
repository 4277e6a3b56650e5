# SPDX-License-Identifier: Apache-2.0
"""The cores of the nodes chained in one process, without ROS: a recording in, grounded commands out.

Each step is the very function or object that the node calls, with the node's own parameters: the listener, the parser,
the gesture reader, `SceneDetector` and the `Session`. What a command may use is what has been seen when the hands up to
a while after its last word are known, as in the reasoner node. So the same recording gives the same answer, however
fast the machine is.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from uncom_language.back_end_factory import recognizer_from_config, understanding_from_config
from uncom_language.types import Act, Command, Transcript
from uncom_perception.hands.hand_bridge import HandBridge
from uncom_perception.hands.make_gesture_reader import load_hand_detectors, make_gesture_reader
from uncom_perception.objects.attributes.lexicon import load_lexicon
from uncom_perception.objects.detectors.make_detector import detector_from_config
from uncom_perception.objects.scene_detector import SceneDetector
from uncom_perception.segmentation.make_segmenter import segmenter_from_config
from uncom_perception.types import HandsFrame
from uncom_reasoner.dialogue.conversation import Conversation
from uncom_reasoner.evidence.gesture_timing import words_span
from uncom_reasoner.session.events import Report
from uncom_reasoner.session.session import Session
from uncom_reasoner.session.synchronous import run_tasks
from uncom_reasoner.types import Decision, Evidence
from uncom_reasoner.weights import Weights, load_weights

from uncom_bringup.chain.config import ChainConfig
from uncom_bringup.chain.recording import Recording
from uncom_bringup.chain.recording_source import RecordingClock, RecordingSource
from uncom_bringup.chain.stage_timer import StageTimer
from uncom_bringup.chain.transcription import Attention, Transcription, transcribe


@dataclass(frozen=True, slots=True)
class Grounding:
    """One command with its decision, and what the decision was made on (None where nothing was looked at)."""

    command: Command
    decision: Decision
    evidence: Evidence | None = None
    others: tuple[Decision, ...] = ()  # of a group, those of the further objects


@dataclass(frozen=True, slots=True)
class ChainResult:
    """All that was made of a recording; latency_s is processor time by stage [s]."""

    transcripts: tuple[Transcript, ...]
    commands: tuple[Command, ...]
    hands: tuple[HandsFrame, ...]
    groundings: tuple[Grounding, ...]
    latency_s: dict[str, float] = field(default_factory=dict)


class Chain:
    """The cores of speech, language, gesture, detection and reasoner; loading them takes some seconds."""

    def __init__(self, config: ChainConfig | None = None) -> None:
        """Load the back ends that the configuration names.

        Raises:
            UncomError: a back end cannot be loaded.
        """
        self.config = config or ChainConfig()
        self._recognizer = recognizer_from_config(self.config.speech)
        self._understanding = understanding_from_config(self.config.language)
        self._hand_detectors = load_hand_detectors(self.config.gesture)
        detection = self.config.detection
        self._detector = SceneDetector(
            detector_from_config(detection, segmenter_from_config(detection)),
            load_lexicon(detection.lexicon or None).same,
            track=detection.track_objects,
        )
        self._weights: Weights = load_weights(self.config.reasoner.weights_file)

    @property
    def backends(self) -> tuple[str, ...]:
        """Name of every back end, in the order of the stages."""
        return (
            self._recognizer.backend,
            self._understanding.backend,
            self.config.gesture.backend,
            self._detector.name,
        )

    def transcribe(self, recording: Recording) -> Transcription:
        """Return what is said, an utterance each, and when a pointing hand is expected for it."""
        return transcribe(self._recognizer, self.config.speech, self.config.gesture.attention_s, recording)

    def parse(self, transcript: Transcript) -> tuple[Command, ...]:
        """Return the commands of one utterance."""
        return self._understanding.understand(transcript)

    def detect_hands(
        self, recording: Recording, until_s: float = float("inf"), attention: Sequence[Attention] = ()
    ) -> tuple[HandsFrame, ...]:
        """Return the hands of every image up to the first one at or after a time [s].

        Args:
            recording: with the images.
            until_s: when to end.
            attention: what is heard meanwhile.
        """
        config, waiting = self.config.gesture, deque(attention)
        reader, bridge = make_gesture_reader(config, self._hand_detectors), HandBridge(config.bridge_s)
        seen: list[HandsFrame] = []
        for frame in recording.frames():
            while waiting and waiting[0].at_s <= frame.stamp_s:
                reader.expect(waiting.popleft().until_s)
            depth = frame.depth if config.use_depth else None
            hands = reader.read(frame.rgb, frame.stamp_s, recording.camera_frame, depth, recording.camera)
            seen.extend(bridge.add(hands))
            if seen and seen[-1].stamp_s >= until_s:
                break
        return tuple(seen)

    def needed_until_s(self, command: Command) -> float:
        """Return up to when [s] hands have to be known before a command is decided on."""
        return words_span(command).end_s + self.config.reasoner.late_pointing_s

    def conversation(self) -> Conversation:
        """Return a conversation without a past."""
        return Conversation(self._weights, self.config.reasoner, self.config.reasoner.question_timeout_s)

    def decide(self, evidence: Evidence) -> Decision:
        """Ground one command that follows no other; of a group the first object."""
        return self.conversation().decide(evidence, 0.0).decisions[0]

    def understand(self, recording: Recording, watch_until_s: float = float("-inf")) -> ChainResult:
        """Understand a recording from its sound to its grounded commands.

        Hands are read as far as the commands need them, and at least up to watch_until_s [s].
        """
        times = StageTimer()
        with times.stage("speech"):
            heard = self.transcribe(recording)
        with times.stage("language"):
            commands = tuple(command for transcript in heard.transcripts for command in self.parse(transcript))
        with times.stage("hands"):
            needed_s = [self.needed_until_s(c) for c in commands if c.act is Act.COMMAND]
            until_s = max([watch_until_s, *needed_s])
            hands = self.detect_hands(recording, until_s, heard.attention) if np.isfinite(until_s) else ()
        groundings = self.ground_all(recording, commands, hands, times=times)
        return ChainResult(heard.transcripts, commands, hands, groundings, times.spent_s)

    def ground_all(
        self,
        recording: Recording,
        commands: Sequence[Command],
        hands: Sequence[HandsFrame],
        *,
        known: Sequence[Evidence] = (),
        times: StageTimer | None = None,
    ) -> tuple[Grounding, ...]:
        """Ground commands one after the other in one session, each with what was said before.

        Nobody answers questions here: a command that is asked about stays so, and what comes after it is left.

        Args:
            recording: with the images.
            commands: in the order of speaking.
            hands: of the recording's images.
            known: of earlier decisions: where the same image was searched for the same phrases, it is not again.
            times: adds up processor time.
        """
        self._detector.forget()
        session = Session(self.config.reasoner, self._weights, RecordingClock())
        source = RecordingSource(recording, hands, session.memory, self._detector, self.config, known)
        times, groundings = times or StageTimer(), list[Grounding]()
        for command in commands:
            with times.stage("detection"):
                source.play_until(self.needed_until_s(command))
            with times.stage("deciding", less="detection"):
                told = (
                    *session.interrupt(command),
                    *session.hear(command),
                    *run_tasks(session, partial(times.timed, "detection", source.detect)),
                )
            groundings += group_reports([event for event in told if isinstance(event, Report)])
            if session.conversation.dialogue.question is not None:
                break
        return tuple(groundings)


def group_reports(reports: Sequence[Report]) -> list[Grounding]:
    """Return a grounding for each command of a sequence of reports."""
    found: list[Grounding] = []
    for report in reports:
        if found and found[-1].command is report.command:
            found[-1] = dataclasses.replace(found[-1], others=(*found[-1].others, report.decision))
        else:
            found.append(Grounding(report.command, report.decision, report.evidence))
    return found
