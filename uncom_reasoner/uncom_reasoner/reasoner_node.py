# SPDX-License-Identifier: Apache-2.0
"""The reasoner node: commands, answers, images and hands in; decisions, questions, explanations and pictures out.

Callbacks store in the session's memory or hand on to the session, which says what is to be done (session/session.py).
What takes long runs on one worker thread, in order; a timer moves the tasks on.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import wraps
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from std_srvs.srv import Trigger
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.exceptions import UncomError
from uncom_language.conversions import command_from_msg

from uncom_interfaces.msg import Command as CommandMsg
from uncom_interfaces.msg import SpeechStatus
from uncom_reasoner.config import ReasonerConfig
from uncom_reasoner.ros.camera_io import CameraIo
from uncom_reasoner.ros.dialogue_io import DialogueIo
from uncom_reasoner.ros.event_publisher import EventPublisher
from uncom_reasoner.ros.worker import Worker
from uncom_reasoner.session.events import DecisionDue, Events
from uncom_reasoner.session.session import FAULT, Session
from uncom_reasoner.session.task import DetectionRequest, GroundingTask
from uncom_reasoner.weights import load_weights

TICK_S = 0.02  # [s] period of the timer that moves the tasks on


class NodeClock:
    """The clock of a node for stamps, and the machine's steady clock for time-outs (a bag's clock may stand still)."""

    def __init__(self, clock: Clock) -> None:
        """Read stamps from a ROS clock."""
        self._clock = clock

    def stamp_s(self) -> float:
        """Return the time of the ROS clock [s]."""
        return float(self._clock.now().nanoseconds) * 1e-9

    def steady_s(self) -> float:
        """Return the time of the steady clock [s]."""
        return time.monotonic()


class ReasonerNode(ConfiguredNode[ReasonerConfig]):
    """Grounds every /uncom/command, and asks where that is in doubt."""

    def __init__(self, **node_options: Any) -> None:
        """Create the session, publishers, subscriptions and services; nothing waits here."""
        super().__init__("reasoner_node", ReasonerConfig, **node_options)
        weights, clock = load_weights(self.config.weights_file), NodeClock(self.get_clock())
        self._session = Session(self.config, weights, clock)
        self._worker = Worker(self.get_logger().error)
        self._publisher = EventPublisher(self, clock, weights, self._session.memory)
        self._checked = True  # whether the worker has done the last check of answers
        self._settled_s = float("-inf")  # newest hands that were looked at for an answer when asked to settle [s]
        self._speaking = False
        sensors = ReentrantCallbackGroup()
        self._camera = CameraIo(self, self.config, self._session, sensors, self._handle)
        self._dialogue = DialogueIo(self, self._session, sensors, self._run, self._handle)
        self.create_subscription(CommandMsg, "/uncom/command", self._on_command, 10)
        if self.config.look_ahead:
            self.create_subscription(SpeechStatus, "/uncom/speech_status", self._on_speech, 10, callback_group=sensors)
        own = MutuallyExclusiveCallbackGroup()
        self.create_service(Trigger, "~/settle", self._on_settle, callback_group=own)
        self.create_timer(TICK_S, self._on_tick, callback_group=own, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info("reasoner ready: posterior over detections, Voronoi places")

    def destroy_node(self) -> None:
        """Let the decision in progress end, then go."""
        self._worker.close()
        super().destroy_node()

    # --- callbacks ----------------------------------------------------------------------------------

    def _on_command(self, msg: CommandMsg) -> None:
        try:
            command = command_from_msg(msg)
        except (UncomError, ValueError) as error:
            self.get_logger().error(str(error))
            return
        self._handle(self._session.interrupt(command))  # at once, whatever is being decided on
        self._run(self._session.hear, command)

    def _on_speech(self, msg: SpeechStatus) -> None:
        """Look at the table when somebody begins to speak."""
        begins = msg.state == SpeechStatus.SPEECH and not self._speaking
        self._speaking = msg.state == SpeechStatus.SPEECH
        if begins and self._camera.detector_ready():
            self._handle(self._session.look_ahead())

    def _on_settle(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Do what can be done with what has come in; success: nothing is left to do until more comes.

        Whoever plays a bag holds it for that, so that no decision depends on the pace. The message is the stamps [s] of
        the newest hands, image and depth.
        """
        latest_s = self._session.memory.hands.latest_s()
        if latest_s != self._settled_s:  # a hand may answer; who looks again each time it is asked never settles
            self._settled_s = latest_s
            self._check_answers()
        self._advance()
        response.success = not (self._worker.busy or self._session.is_working)
        response.message = f"{latest_s!r} {self._camera.image_s!r} {self._camera.depth_s!r}"
        return response

    def _on_tick(self) -> None:
        self._check_answers()
        self._advance()

    # --- driving the session ------------------------------------------------------------------------

    def _check_answers(self) -> None:
        if self._checked and self._session.awaits_answer:
            self._checked = False
            self._worker.run(self._check_answers_on_worker)

    def _check_answers_on_worker(self) -> None:
        self._handle(self._session.check_answers())
        self._checked = True

    def _advance(self) -> None:
        self._handle(self._session.advance(detector_ready=self._camera.detector_ready()))

    def _run(self, method: Callable[..., Events], *args: object) -> None:
        """Call a method of the session on the worker and do what it returns."""

        @wraps(method)
        def work() -> None:
            self._handle(method(*args))

        self._worker.run(work)

    def _handle(self, events: Events) -> None:
        """Do what the session wants done."""
        for event in events:
            if isinstance(event, DetectionRequest):
                self._camera.detect(event)
            elif isinstance(event, DecisionDue):
                self._worker.run(self._decide, event.task)
        self._publisher.publish(events)

    def _decide(self, task: GroundingTask) -> None:
        try:
            events = self._session.decide(task)
        except Exception as error:  # noqa: BLE001 (whatever goes wrong with one command, the next one must work)
            self.get_logger().error(f"deciding on {task.command.text!r} failed: {error!r}")
            events = self._session.give_up(task, FAULT)
        self._handle(events)


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(ReasonerNode, args))


if __name__ == "__main__":
    main()
