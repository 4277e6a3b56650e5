# SPDX-License-Identifier: Apache-2.0
"""The reasoner's plumbing: commands, answers and what is seen in; decisions, questions, reasons and pictures out.

Callbacks store or hand on; everything that thinks runs on one worker thread, in order. A timer moves the commands on:
one at a time, each wait with a time-out, whatever becomes of the others.
"""

from __future__ import annotations

import sys
import threading
import time
from collections import deque
from dataclasses import replace
from functools import partial
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from std_msgs.msg import Empty
from std_srvs.srv import Trigger
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.exceptions import UncomError
from uncom_language.conversions import command_from_msg
from uncom_language.types import Act, Command
from uncom_perception.conversions import scene_from_response

from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.msg import SpeechStatus
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.detector_phrases import CONTAINER, OBJECTS, goes_back, phrases_of
from uncom_reasoner.dialogue.conversation import Again, Conversation, Turn
from uncom_reasoner.dialogue.types import Answer, End, Ending
from uncom_reasoner.evidence.evidence_builder import evidence_of
from uncom_reasoner.evidence.grounding_job import Job, Stage, out_of_time
from uncom_reasoner.evidence.sensor_memory import Senses
from uncom_reasoner.grounding.decision import failed
from uncom_reasoner.grounding.phrasing import proposal, refusal
from uncom_reasoner.ros.camera_io import Looking
from uncom_reasoner.ros.decision_publisher import Telling
from uncom_reasoner.ros.dialogue_io import Asking
from uncom_reasoner.ros.worker import Worker
from uncom_reasoner.types import Decision, Status
from uncom_reasoner.weights import load_weights

TICK_S = 0.02


class ReasonerNode(ConfiguredNode[ReasonerConfig]):
    """Grounds every /uncom/command, and asks where that is in doubt."""

    def __init__(self, **node_options: Any) -> None:
        """Connect; nothing waits here."""
        super().__init__("reasoner_node", ReasonerConfig, **node_options)
        config = self.config
        self._weights = load_weights(config.weights_file)
        self._talk = Conversation(self._weights, config.placing(), config.question_timeout_s)
        self._senses = Senses(config)
        self._jobs: deque[Job] = deque()
        self._lock = threading.Lock()
        self._polled = True  # whether the worker has done the last round of time-outs
        self._settled_s = float("-inf")  # newest hands that were looked at for an answer when asked to settle [s]
        self._worker = Worker(self.get_logger().error)
        senses = ReentrantCallbackGroup()
        self._looking = Looking(self, config, self._senses, senses)
        self._asking = Asking(self, config, senses, self._worker.run, self._take_answer)
        self._telling = Telling(self, config, self._weights, self._senses)
        self._stop = self.create_publisher(Empty, "/uncom/stop", 10)
        self.create_subscription(CommandMsg, "/uncom/command", self._on_command, 10)
        if config.look_ahead:
            self.create_subscription(SpeechStatus, "/uncom/speech_status", self._on_speech, 10, callback_group=senses)
        self._speaking = False
        own = MutuallyExclusiveCallbackGroup()
        self.create_service(Trigger, "~/settle", self._on_settle, callback_group=own)
        self.create_timer(TICK_S, self._tick, callback_group=own, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info("reasoner ready: posterior over detections, Voronoi places")

    def destroy_node(self) -> None:
        """Let the decision in progress end, then go."""
        self._worker.close()
        super().destroy_node()

    # --- what comes in ------------------------------------------------------------------------------

    def _on_command(self, msg: CommandMsg) -> None:
        try:
            command = command_from_msg(msg)
        except (UncomError, ValueError) as error:
            self.get_logger().error(str(error))
            return
        if command.act in (Act.STOP, Act.CANCEL):
            self._stop.publish(Empty())  # at once, whatever is being thought about
            with self._lock:
                self._jobs.clear()
        self._worker.run(self._hear, command)

    def _on_speech(self, msg: SpeechStatus) -> None:
        """Look at the table when somebody begins to speak: things do not move while a person speaks."""
        begins = msg.state == SpeechStatus.SPEECH and not self._speaking
        self._speaking = msg.state == SpeechStatus.SPEECH
        if begins and self._looking.ready():
            ahead = self._senses.look_ahead(self._now_s())
            if ahead is not None:
                self._looking.detect(ahead, (CONTAINER, OBJECTS), lambda _: None, with_hand=False)

    def _on_settle(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Do what can be done with what has come in; success: nothing is left to do until more comes.

        Whoever plays a bag holds it for that, so that no decision depends on the pace. The message is the stamps [s] of
        the newest hands, image and depth.
        """
        latest_s = self._senses.hands.latest_s()
        if latest_s != self._settled_s:  # a hand may answer; who looks again each time it is asked never settles
            self._settled_s = latest_s
            self._look_for_answers()
        self._go_on()
        with self._lock:
            job = self._jobs[0] if self._jobs else None
            busy = self._worker.busy or (job is not None and job.stage in (Stage.DETECTING, Stage.DECIDING))
        response.success = not busy
        response.message = f"{latest_s!r} {self._looking.image_s!r} {self._looking.depth_s!r}"
        return response

    def _take_answer(self, answer: Answer) -> None:
        self._follow(self._talk.dialogue.answered(answer))

    def _now_s(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    # --- what was said, on the worker ----------------------------------------------------------------

    def _hear(self, command: Command) -> None:
        ended = self._asking.waiting and self._asking.heard(command) is not None
        if ended and command.act in (Act.YES, Act.NO):
            return
        question = self._talk.dialogue.question
        if question is not None and not (command.act is Act.COMMAND and command.utterance_id == question.utterance_id):
            ending = self._talk.dialogue.heard(command)
            if ending is None:
                self._asking.say(self._talk.dialogue.reminder())
                return
            self._follow(ending)
            if ending.end is not End.DROPPED:
                return
        self._begin(command)

    def _begin(self, command: Command) -> None:
        """Start on what was said when no question is open."""
        if command.act is Act.COMMAND or (command.act is Act.INCOMPLETE and goes_back(command)):
            self._enqueue(Again(replace(command, act=Act.COMMAND)))
        elif command.act is Act.CORRECTION:
            change = self._talk.correct(command)
            if change is not None:
                self._take_back(change)
                self._enqueue(change, first=True)
            else:
                self._refuse(command, "I have done nothing that I could correct.")
        elif command.act in (Act.REFUSED, Act.INCOMPLETE, Act.FRAGMENT):
            self._refuse(command, refusal(command))

    def _take_back(self, change: Again) -> None:
        """Tell that the command which is corrected is not to be done any more."""
        if change.replaces is not None:
            grounded = replace(failed(change.replaces, "Corrected."), status=Status.CANCELLED)
            self._telling.tell(change.replaces, Decision(grounded), 0.0)

    def _enqueue(self, change: Again, *, first: bool = False) -> None:
        job = Job(change.command, self._now_s(), time.monotonic(), change.given, change.asked)
        with self._lock:
            if first:
                self._jobs.appendleft(job)
            else:
                self._jobs.append(job)

    def _follow(self, ending: Ending | None) -> None:
        """Take the end of a question into the command that it was about."""
        following = self._talk.end(ending, time.monotonic()) if ending is not None else None
        if isinstance(following, Again):
            self._enqueue(following, first=True)
        elif following is not None:
            self._publish(following, 0.0, 0.0)

    def _poll(self) -> None:
        """End what is out of time, and see whether a hand answers."""
        self._asking.tick()
        dialogue = self._talk.dialogue
        if dialogue.question is not None:
            ending = dialogue.tick(time.monotonic())
            if ending is None:
                now_s = self._now_s()
                asked_s = now_s - (time.monotonic() - dialogue.asked_s)
                ending = self._talk.pointing_answer(self._senses.rays_between(asked_s, now_s), asked_s, now_s)
            self._follow(ending)
        self._polled = True

    # --- one command after the other -----------------------------------------------------------------

    def _tick(self) -> None:
        self._look_for_answers()
        self._go_on()

    def _look_for_answers(self) -> None:
        if self._polled and (self._talk.dialogue.question is not None or self._asking.waiting):
            self._polled = False
            self._worker.run(self._poll)

    def _go_on(self) -> None:
        """Move the first command on as far as what has come in allows."""
        with self._lock:
            job = self._jobs[0] if self._jobs else None
        if job is None or (self._talk.dialogue.question is not None and job.asked == 0):
            return
        wall = time.monotonic()
        late, limit = self.config.late_pointing_s, self.config.wait_timeout_s
        over = out_of_time(job, self._now_s(), wall, late, limit)
        if job.stage is Stage.LOOKING:
            until = self._senses.look_until(job.command)
            if over or until is not None:
                self._look(job, wall, until)
        elif job.stage is Stage.DETECTING and wall - job.asked_wall_s > self.config.detect_timeout_s:
            self._give_up(job, "I cannot look at the table: the object detector does not answer.")
        elif job.stage is Stage.WAITING:
            until = self._senses.hands_until(job.command, self._weights)
            if over or until is not None:
                job.stage, job.until_s = Stage.DECIDING, float("inf") if until is None else until
                job.timings_s["hands"] = wall - job.received_wall_s
                self._worker.run(self._decide, job)

    def _look(self, job: Job, wall: float, until_s: float | None) -> None:
        """Ask the detector for the things of the frame that shows them best; the timer waits for the answer."""
        choice = self._senses.scene_frame(job.command, float("inf") if until_s is None else until_s)
        if choice is None or self._senses.camera_info is None:
            self._give_up(job, "I see nothing: no camera images arrive.")
            return
        if not self._looking.ready():
            if wall - job.received_wall_s > self.config.detect_timeout_s:
                self._give_up(job, "I cannot look at the table: the object detector is not running.")
            return
        job.scene_s, job.with_hand = choice.stamp_s, choice.with_hand
        job.phrases = phrases_of(job.command, self._talk.memory.noun)
        job.stage, job.asked_wall_s = Stage.DETECTING, wall
        done = partial(self._on_scene, job)
        if not self._looking.detect(job.scene_s, job.phrases, done, with_hand=job.with_hand):
            self._give_up(job, "I see nothing: the image is gone.")

    def _on_scene(self, job: Job, done: Any) -> None:
        """Keep the detector's answer, unless it comes too late."""
        response = done.result() if done.exception() is None else None
        with self._lock:
            if not self._jobs or self._jobs[0] is not job or job.stage is not Stage.DETECTING:
                return
        if response is None or not response.success:
            self._give_up(job, f"I cannot look at the table: {response.reason if response else 'no answer'}")
            return
        job.scene = scene_from_response(response)
        job.timings_s["detection"] = time.monotonic() - job.asked_wall_s
        job.stage = Stage.WAITING

    def _decide(self, job: Job) -> None:
        begin = time.monotonic()
        try:
            turn = self._talk.decide(evidence_of(job, self._senses, self.config.base_frame), begin, job.asked)
        except Exception as error:  # noqa: BLE001 (whatever goes wrong with one command, the next one must work)
            self.get_logger().error(f"deciding on {job.command.text!r} failed: {error!r}")
            self._give_up(job, "Something went wrong while I thought about it. Please say it again.")
            return
        job.timings_s["deciding"] = time.monotonic() - begin
        with self._lock:
            if not self._jobs or self._jobs[0] is not job:
                self._talk.forget()  # stopped meanwhile
                return
            self._jobs.popleft()
        self.get_logger().info(
            f"{job.command.text!r}: " + ", ".join(f"{name} {took:.3f} s" for name, took in job.timings_s.items())
        )
        self._publish(turn, job.scene_s, time.monotonic() - job.received_wall_s)

    # --- what goes out -------------------------------------------------------------------------------

    def _give_up(self, job: Job, reason: str) -> None:
        with self._lock:
            if self._jobs and self._jobs[0] is job:
                self._jobs.popleft()
        self._refuse(job.command, reason, job.received_wall_s)

    def _refuse(self, command: Command, reason: str, since_wall_s: float | None = None) -> None:
        took = time.monotonic() - since_wall_s if since_wall_s is not None else 0.0
        decision = Decision(replace(failed(command, reason), latency_s=took))
        self._asking.say(self._telling.tell(command, decision, 0.0))

    def _publish(self, turn: Turn, scene_s: float, latency_s: float) -> None:
        said = []
        for decision in turn.decisions:
            told = replace(decision, grounded=replace(decision.grounded, latency_s=latency_s))
            if told.grounded.status is Status.GROUNDED:
                words = proposal(turn.command, told.grounded)
                self._asking.plan(told.grounded.utterance_id, told.grounded.index, words)
            said.append(self._telling.tell(turn.command, told, scene_s))
        if turn.question is not None:
            self._asking.ask(turn.question)
        self._asking.say(said[0])
        for decision in turn.decisions:
            self._telling.draw(decision, turn.evidence.view)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(ReasonerNode, args))


if __name__ == "__main__":
    main()
