# SPDX-License-Identifier: Apache-2.0
"""From commands, images and hands to decisions, questions and sentences: one session with one person. No ROS.

The reasoner node and the chain of the benchmark both drive this class. Time is passed in (`Clock`), what is seen goes
into `memory`, and what is to be done comes back as values (`events`). Detection takes its time elsewhere: the session
returns a `DetectionRequest` and is given the scene later with `take_scene`, so that no call here waits.

What each act of an utterance does:

* COMMAND (and "put it back" without a target): joins the tasks, which are grounded one after the other;
* CORRECTION: the last command is taken back, and the amended one is grounded next;
* YES, NO: end the open question, whether a motion may begin first; without a question they do nothing;
* STOP, CANCEL: `interrupt` stops the motion at once and drops all tasks; `hear` ends the open question;
* FRAGMENT: answers the open question; else refused, as INCOMPLETE and REFUSED are, with a sentence that says why.

Threads: `interrupt`, `advance`, `take_scene`, `give_up` and `look_ahead` may be called from any thread and return at
once. `hear`, `take_answer`, `check_answers`, `decide` and the consent methods are for one thread, in the order of what
happened; `decide` is the slow one.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import replace

from uncom_language.types import Act, Command
from uncom_perception.types import Scene

from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.detector_phrases import CONTAINER, OBJECTS, asks_to_return, phrases_for
from uncom_reasoner.dialogue.conversation import AmendedCommand, Conversation, Turn
from uncom_reasoner.dialogue.types import Answer, End, Ending
from uncom_reasoner.evidence.evidence_builder import build_evidence
from uncom_reasoner.evidence.sensor_memory import SensorMemory
from uncom_reasoner.exceptions import InvalidGroundingError
from uncom_reasoner.grounding.decision import failed_command
from uncom_reasoner.grounding.phrasing import compose_proposal, compose_refusal, compose_sentence
from uncom_reasoner.session.clock import Clock
from uncom_reasoner.session.consent import ConsentGate
from uncom_reasoner.session.events import DecisionDue, Events, QuestionAsked, Report, StageTimes, StopMotion, say
from uncom_reasoner.session.options import SESSION, SessionOptions
from uncom_reasoner.session.task import DetectionRequest, GroundingTask, TaskStage
from uncom_reasoner.types import Decision, Status
from uncom_reasoner.weights import Weights

FAULT = "Something went wrong while I thought about it. Please say it again."


class Session:
    """What was said and seen so far, the tasks that wait, and the open questions."""

    def __init__(
        self, config: ReasonerConfig, weights: Weights, clock: Clock, options: SessionOptions = SESSION
    ) -> None:
        """Start without a past.

        Args:
            config: parameters of the reasoner node.
            weights: of the posterior.
            clock: that times are read from.
            options: waits and bounds.
        """
        self._config, self._weights, self._clock, self._options = config, weights, clock, options
        self.memory = SensorMemory(config)
        self.conversation = Conversation(weights, config, config.question_timeout_s)
        self.consent = ConsentGate(clock, config.approval_timeout_s, options)
        self._tasks: deque[GroundingTask] = deque()
        self._lock = threading.Lock()  # of the tasks

    # --- what was said ------------------------------------------------------------------------------

    def interrupt(self, command: Command) -> Events:
        """Do at once what cannot wait until `hear`: stop and cancel end the motion and all tasks."""
        if command.act not in (Act.STOP, Act.CANCEL):
            return ()
        with self._lock:
            self._tasks.clear()
        return (StopMotion(),)

    def hear(self, command: Command) -> Events:
        """Take an utterance: as the answer to an open question, or as a new wish."""
        consent_open = self.consent.question is not None
        events = self.consent.hear(command)
        if consent_open and self.consent.question is None and command.act in (Act.YES, Act.NO):
            return events
        dialogue = self.conversation.dialogue
        question = dialogue.question
        if question is not None and not (command.act is Act.COMMAND and command.utterance_id == question.utterance_id):
            ending = dialogue.heard(command)
            if ending is None:
                return (*events, *say(dialogue.reminder()))
            events += self._follow(ending)
            if ending.end is not End.DROPPED:
                return events
        return events + self._begin(command)

    def _begin(self, command: Command) -> Events:
        """Start on what was said when no question is open."""
        if command.act is Act.COMMAND or (command.act is Act.INCOMPLETE and asks_to_return(command)):
            self._enqueue(AmendedCommand(replace(command, act=Act.COMMAND)))
        elif command.act is Act.CORRECTION:
            amended = self.conversation.correct(command)
            if amended is None:
                return self._refuse(command, "I have done nothing that I could correct.")
            self._enqueue(amended, first=True)
            return self._take_back(amended)
        elif command.act in (Act.REFUSED, Act.INCOMPLETE, Act.FRAGMENT):
            return self._refuse(command, compose_refusal(command))
        return ()

    def _take_back(self, amended: AmendedCommand) -> Events:
        """Tell that the command which is corrected is not to be done any more."""
        command = amended.replaces
        if command is None:
            return ()
        grounded = replace(failed_command(command, "Corrected."), status=Status.CANCELLED)
        return (Report(command, Decision(grounded), compose_sentence(command, grounded)),)

    def _enqueue(self, change: AmendedCommand, *, first: bool = False) -> None:
        task = GroundingTask(
            change.command, self._clock.stamp_s(), self._clock.steady_s(), change.given, change.questions_asked
        )
        with self._lock:
            if first:
                self._tasks.appendleft(task)
            else:
                self._tasks.append(task)

    # --- answers ------------------------------------------------------------------------------------

    def take_answer(self, answer: Answer) -> Events:
        """Take an answer that names its question (by message, not by speech)."""
        if self.consent.is_about_consent(answer.question_id):
            self.consent.answered(answer)
            return ()
        return self._follow(self.conversation.dialogue.answered(answer))

    @property
    def awaits_answer(self) -> bool:
        """Whether a question is open, so that `check_answers` has something to do."""
        return self.conversation.dialogue.question is not None or self.consent.question is not None

    def check_answers(self) -> Events:
        """End the questions that are out of time, and see whether a hand answers."""
        events = self.consent.check_time()
        dialogue = self.conversation.dialogue
        if dialogue.question is None:
            return events
        ending = dialogue.tick(self._clock.steady_s())
        if ending is None:
            now_s = self._clock.stamp_s()
            asked_s = now_s - (self._clock.steady_s() - dialogue.asked_s)
            ending = self.conversation.pointing_answer(self.memory.rays_between(asked_s, now_s), asked_s, now_s)
        return events + self._follow(ending)

    def _follow(self, ending: Ending | None) -> Events:
        """Take the end of a question into the command that it was about."""
        following = self.conversation.conclude(ending, self._clock.steady_s()) if ending is not None else None
        if isinstance(following, AmendedCommand):
            self._enqueue(following, first=True)
        elif following is not None:
            return self._report(following, 0.0, 0.0)
        return ()

    # --- one task after the other -------------------------------------------------------------------

    @property
    def is_working(self) -> bool:
        """Whether a detection or a decision is under way."""
        task = self._first_task()
        return task is not None and task.stage in (TaskStage.DETECTION, TaskStage.DECISION)

    def _first_task(self) -> GroundingTask | None:
        with self._lock:
            return self._tasks[0] if self._tasks else None

    def advance(self, *, detector_ready: bool) -> Events:
        """Move the first task on as far as what has been seen allows: a detection, a decision, or giving up."""
        task = self._first_task()
        if task is None or (self.conversation.dialogue.question is not None and task.questions_asked == 0):
            return ()
        config, steady_s = self._config, self._clock.steady_s()
        over = task.is_out_of_time(
            self._clock.stamp_s(), steady_s, config.late_pointing_s, config.wait_timeout_s, self._options
        )
        if task.stage is TaskStage.FRAME:
            until_s = self.memory.frame_choice_until_s(task.command)
            if over or until_s is not None:
                return self._request_scene(task, float("inf") if until_s is None else until_s, detector_ready)
        elif task.stage is TaskStage.DETECTION and steady_s - task.requested_steady_s > config.detect_timeout_s:
            return self.give_up(task, "I cannot look at the table: the object detector does not answer.")
        elif task.stage is TaskStage.HANDS:
            complete_s = self.memory.gestures_complete_at_s(task.command, self._weights)
            if over or complete_s is not None:
                task.stage, task.hands_until_s = TaskStage.DECISION, float("inf") if complete_s is None else complete_s
                task.durations_s["hands"] = steady_s - task.received_steady_s
                return (DecisionDue(task),)
        return ()

    def _request_scene(self, task: GroundingTask, until_s: float, detector_ready: bool) -> Events:
        """Ask for the objects of the frame that shows them best."""
        frame = self.memory.choose_frame(task.command, until_s)
        if frame is None or self.memory.camera is None:
            return self.give_up(task, "I see nothing: no camera images arrive.")
        steady_s = self._clock.steady_s()
        if not detector_ready:
            if steady_s - task.received_steady_s > self._config.detect_timeout_s:
                return self.give_up(task, "I cannot look at the table: the object detector is not running.")
            return ()
        if self.memory.image_at(frame.stamp_s) is None:
            return self.give_up(task, "I see nothing: the image is gone.")
        task.request = DetectionRequest(frame, phrases_for(task.command, self.conversation.memory.noun))
        task.stage, task.requested_steady_s = TaskStage.DETECTION, steady_s
        return (task.request,)

    def take_scene(self, request: DetectionRequest, scene: Scene) -> None:
        """Take the detector's answer, unless it comes too late or nobody waits for it."""
        task = self._waiting_for(request)
        if task is not None:
            task.scene = scene
            task.durations_s["detection"] = self._clock.steady_s() - task.requested_steady_s
            task.stage = TaskStage.HANDS

    def take_failure(self, request: DetectionRequest, reason: str) -> Events:
        """Give up the task whose detection failed."""
        task = self._waiting_for(request)
        return self.give_up(task, f"I cannot look at the table: {reason}") if task is not None else ()

    def _waiting_for(self, request: DetectionRequest) -> GroundingTask | None:
        task = self._first_task()
        waits = task is not None and task.stage is TaskStage.DETECTION and task.request is request
        return task if waits else None

    def decide(self, task: GroundingTask) -> Events:
        """Decide on the first task; nothing is told of one that was stopped meanwhile.

        Raises:
            InvalidGroundingError: nothing was looked at for the task.
        """
        if task.scene is None or task.request is None:
            raise InvalidGroundingError("a command is decided on before anything was seen")
        begin_s = self._clock.steady_s()
        frame, phrases = task.request.frame, task.request.phrases
        evidence = build_evidence(task.command, task.scene, frame, phrases, task.given, self.memory, task.hands_until_s)
        turn = self.conversation.decide(evidence, begin_s, task.questions_asked)
        steady_s = self._clock.steady_s()
        task.durations_s["deciding"] = steady_s - begin_s
        with self._lock:
            if not self._tasks or self._tasks[0] is not task:
                self.conversation.drop_question()
                return ()
            self._tasks.popleft()
        times = StageTimes(task.command, dict(task.durations_s))
        return (times, *self._report(turn, frame.stamp_s, steady_s - task.received_steady_s))

    def give_up(self, task: GroundingTask, reason: str) -> Events:
        """Drop a task and say why."""
        with self._lock:
            if self._tasks and self._tasks[0] is task:
                self._tasks.popleft()
        return self._refuse(task.command, reason, self._clock.steady_s() - task.received_steady_s)

    def look_ahead(self) -> Events:
        """Ask for the objects in a newest frame without a hand: objects do not move while a person speaks.

        The detector knows that image when the command asks for it; the answer itself is not used.
        """
        frame = self.memory.choose_frame_ahead(self._clock.stamp_s())
        return (DetectionRequest(frame, (CONTAINER, OBJECTS)),) if frame is not None else ()

    # --- what is told -------------------------------------------------------------------------------

    def _refuse(self, command: Command, reason: str, latency_s: float = 0.0) -> Events:
        grounded = replace(failed_command(command, reason), latency_s=latency_s)
        words = compose_sentence(command, grounded)
        return (Report(command, Decision(grounded), words), *say(words))

    def _report(self, turn: Turn, scene_s: float, latency_s: float) -> Events:
        reports = []
        for decision in turn.decisions:
            grounded = replace(decision.grounded, latency_s=latency_s)
            if grounded.status is Status.GROUNDED:
                self.consent.expect(grounded.utterance_id, grounded.index, compose_proposal(turn.command, grounded))
            words = compose_sentence(turn.command, grounded)
            reports.append(Report(turn.command, replace(decision, grounded=grounded), words, scene_s, turn.evidence))
        question = () if turn.question is None else (QuestionAsked(turn.question),)
        return (*reports, *question, *say(reports[0].sentence))
