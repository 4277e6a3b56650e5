# SPDX-License-Identifier: Apache-2.0
"""The cores of the nodes chained in one process, without ROS: a recording in, grounded commands out.

Each step is the very function that the node calls, with the node's own parameters; what a command may use is what has
been seen when the hands up to a while after its last word are known, as in the reasoner node. So the same recording
gives the same answer, however fast the machine is.
"""

from __future__ import annotations

import dataclasses
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from uncom_common.exceptions import UncomError
from uncom_language.back_end_factory import recognizer_from_config, understanding_from_config
from uncom_language.types import Act, Command, Transcript
from uncom_perception.hands.backends import load_hand_detectors, make_gesture_reader
from uncom_perception.hands.bridge import HandBridge
from uncom_perception.objects.detectors.make_detector import detector_of
from uncom_perception.objects.tracking.object_tracker import ObjectTracker
from uncom_perception.segmentation.backends import segmenter_of
from uncom_perception.types import HandsFrame, Scene
from uncom_reasoner.detector_phrases import goes_back, phrases_of
from uncom_reasoner.dialogue.conversation import Conversation
from uncom_reasoner.evidence.evidence_builder import evidence_of
from uncom_reasoner.evidence.grounding_job import Job, words_span
from uncom_reasoner.evidence.sensor_memory import SeenHands, Senses
from uncom_reasoner.grounding.decision import failed
from uncom_reasoner.grounding.phrasing import refusal
from uncom_reasoner.posterior.discourse_memory import Memory
from uncom_reasoner.types import Decision, Evidence
from uncom_reasoner.weights import Weights, load_weights

from uncom_bringup.chain.config import ChainConfig
from uncom_bringup.chain.hearing import Attention, Heard, hear
from uncom_bringup.chain.recording import Recording, Rgb


@dataclass(frozen=True, slots=True)
class Grounding:
    """One command with its decision, and what the decision was made on (None where nothing was looked at)."""

    command: Command
    decision: Decision
    evidence: Evidence | None = None
    others: tuple[Decision, ...] = ()  # of a group, those of the further things


@dataclass(frozen=True, slots=True)
class ChainResult:
    """All that was made of a recording; latency_s is processor time by stage [s]."""

    transcripts: tuple[Transcript, ...]
    commands: tuple[Command, ...]
    hands: tuple[HandsFrame, ...]
    groundings: tuple[Grounding, ...]
    latency_s: dict[str, float] = field(default_factory=dict)


class _Clock:
    """Adds up processor time by stage."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}

    def add(self, stage: str, since: float) -> None:
        self.spent[stage] = self.spent.get(stage, 0.0) + time.process_time() - since


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
        self._detector = detector_of(self.config.detection, segmenter_of(self.config.detection))
        self._weights: Weights = load_weights(self.config.reasoner.weights_file)
        self._placing = self.config.reasoner.placing()

    @property
    def backends(self) -> tuple[str, ...]:
        """Name of every back end, in the order of the stages."""
        return (
            self._recognizer.backend, self._understanding.backend, self.config.gesture.backend, self._detector.name,
        )  # fmt: skip

    def hear(self, recording: Recording) -> Heard:
        """Return what is said, an utterance each, and when that makes the eyes attentive."""
        return hear(self._recognizer, self.config.speech, self.config.gesture.attention_s, recording)

    def parse(self, transcript: Transcript) -> tuple[Command, ...]:
        """Return the commands of one utterance."""
        return self._understanding.understand(transcript)

    def watch(
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

    def look(
        self,
        recording: Recording,
        command: Command,
        hands: Sequence[HandsFrame],
        memory: Memory,
        known: Sequence[Evidence] = (),
        tracker: ObjectTracker | None = None,
    ) -> Evidence | None:
        """Gather what a command is decided on; None if there is no image.

        Where the same image was searched for the same phrases before (`known`), it is not searched again. The tracker
        knows the things of earlier images.

        Raises:
            UncomError: the detector cannot work with the image.
        """
        senses = self._senses(recording, hands, self.needed_until_s(command))
        until_s = senses.look_until(command)
        choice = senses.scene_frame(command, float("inf") if until_s is None else until_s)
        image = senses.image_at(choice.stamp_s) if choice is not None else None
        if choice is None or image is None:
            return None
        job = Job(command, 0.0, 0.0, scene_s=choice.stamp_s, with_hand=choice.with_hand)
        job.phrases = phrases_of(command, memory.noun)
        same = (e.scene for e in known if e.scene.stamp_s == choice.stamp_s and e.phrases == job.phrases)
        job.scene = next(same, None) or self._detect(recording, senses, job, image, tracker)
        enough_s = senses.hands_until(command, self._weights)
        job.until_s = float("inf") if enough_s is None else enough_s
        return evidence_of(job, senses, self.config.reasoner.base_frame)

    def _detect(
        self, recording: Recording, senses: Senses, job: Job, image: Rgb, tracker: ObjectTracker | None
    ) -> Scene:
        pose = senses.camera_in_base(job.scene_s)
        scene = self._detector.detect(
            image,
            senses.depth_at(job.scene_s),
            recording.camera,
            pose,
            job.phrases,
            senses.hands_at(job.scene_s) if job.with_hand else None,
            job.scene_s,
        )
        frame_id = self.config.reasoner.base_frame if pose is not None else recording.camera_frame
        scene = dataclasses.replace(scene, frame_id=frame_id)
        if not self.config.detection.track_objects or pose is None:
            return scene
        depth = senses.depth_at(job.scene_s)
        return (tracker or ObjectTracker()).update(scene, depth, recording.camera, pose)

    def _senses(self, recording: Recording, hands: Sequence[HandsFrame], until_s: float) -> Senses:
        """Remember what came up to the first image at or after a time [s]."""
        senses = Senses(self.config.reasoner)
        senses.camera, senses.camera_frame = recording.camera, recording.camera_frame
        for transform, static in recording.transforms:
            senses.transforms.add(transform, static=static)
        for frame in recording.frames():
            senses.images.add(frame.stamp_s, frame.rgb)
            if frame.depth is not None and self.config.reasoner.use_depth:
                senses.depths.add(frame.stamp_s, frame.depth)
            if frame.stamp_s >= until_s:
                break
        last_s = senses.images.latest_s()
        for seen in hands:
            if seen.stamp_s <= last_s:
                senses.hands.add(seen.stamp_s, SeenHands(seen, seen))
        return senses

    def conversation(self) -> Conversation:
        """Return a conversation without a past."""
        return Conversation(self._weights, self._placing, self.config.reasoner.question_timeout_s)

    def decide(self, evidence: Evidence) -> Decision:
        """Ground one command that follows no other; of a group the first thing."""
        return self.conversation().decide(evidence, 0.0).decisions[0]

    def understand(self, recording: Recording, watch_until_s: float = float("-inf")) -> ChainResult:
        """Understand a recording from its sound to its grounded commands.

        Hands are read as far as the commands need them, and at least up to watch_until_s [s].
        """
        clock = _Clock()
        start = time.process_time()
        heard = self.hear(recording)
        clock.add("speech", start)
        start = time.process_time()
        commands = tuple(command for transcript in heard.transcripts for command in self.parse(transcript))
        clock.add("language", start)
        wanted = [self.needed_until_s(c) for c in commands if c.act is Act.COMMAND]
        start = time.process_time()
        until_s = max([watch_until_s, *wanted])
        hands = self.watch(recording, until_s, heard.attention) if np.isfinite(until_s) else ()
        clock.add("hands", start)
        groundings = self.ground_all(recording, commands, hands, clock=clock)
        return ChainResult(heard.transcripts, commands, hands, groundings, clock.spent)

    def ground_all(
        self,
        recording: Recording,
        commands: Sequence[Command],
        hands: Sequence[HandsFrame],
        *,
        scenes: Sequence[Evidence] = (),
        clock: _Clock | None = None,
    ) -> tuple[Grounding, ...]:
        """Ground commands one after the other, each knowing of those before; scenes are looked at already.

        Nobody answers questions here: a command that is asked about stays so, and what comes after it is left.
        """
        clock, talk, tracker = clock or _Clock(), self.conversation(), ObjectTracker()
        done: list[Grounding] = []
        for command in commands:
            grounding = self._ground(recording, command, hands, scenes, (talk, tracker), clock)
            if grounding is not None:
                done.append(grounding)
            if talk.dialogue.question is not None:
                break
        return tuple(done)

    def _ground(
        self,
        recording: Recording,
        command: Command,
        hands: Sequence[HandsFrame],
        scenes: Sequence[Evidence],
        so_far: tuple[Conversation, ObjectTracker],
        clock: _Clock,
    ) -> Grounding | None:
        talk, tracker = so_far
        if command.act is Act.INCOMPLETE and goes_back(command):
            command = dataclasses.replace(command, act=Act.COMMAND)
        if command.act in (Act.REFUSED, Act.INCOMPLETE, Act.FRAGMENT):
            return Grounding(command, Decision(failed(command, refusal(command))))
        if command.act is not Act.COMMAND:
            return None
        start = time.process_time()
        try:
            evidence = self.look(recording, command, hands, talk.memory, scenes, tracker)
        except UncomError as error:
            return Grounding(command, Decision(failed(command, f"I cannot look at the table: {error}")))
        clock.add("detection", start)
        if evidence is None:
            return Grounding(command, Decision(failed(command, "I see nothing: no camera images arrive.")))
        start = time.process_time()
        turn = talk.decide(evidence, 0.0)
        clock.add("deciding", start)
        return Grounding(command, turn.decisions[0], evidence, turn.decisions[1:])
