# SPDX-License-Identifier: Apache-2.0
"""Plays a bag to running nodes as fast as they answer: nothing is dropped, and no answer depends on speed.

After each message a barrier makes sure that the nodes have taken it; images, which may be overtaken by small messages
when the machine is busy, are counted by the nodes themselves. What a node does in a thread of its own is waited for by
what it publishes or answers: hands for each picture, the end of recognising for each utterance, commands for each
transcript, and the reasoner says itself when it can do no more with what it has.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from audio_common_msgs.msg import AudioDataStamped
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger
from uncom_common.conversions import seconds_from_msg, time_to_msg
from uncom_perception.frames import read_stamp_ns

from uncom_bringup.bags.bag_reader import BagMessage, BagReader
from uncom_bringup.bags.depth_first_order import with_depth_first
from uncom_bringup.exceptions import GraphError
from uncom_bringup.graph import topics
from uncom_bringup.graph.node_specs import GESTURE_NODE, LANGUAGE_NODE, REASONER_NODE, SPEECH_NODE
from uncom_bringup.monitor import run_record
from uncom_bringup.monitor.monitor_node import MonitorNode
from uncom_bringup.monitor.run_record import Event
from uncom_bringup.replay.player_node import PlayerNode
from uncom_bringup.ros.delivery_confirmation import DeliveryConfirmation
from uncom_bringup.ros.node_outputs import NodeOutputs
from uncom_bringup.ros.options import LOCKSTEP, LockstepOptions
from uncom_bringup.ros.topic_subscribers import NODES, TopicSubscribers

_VOCABULARY = "/uncom/vocabulary"
SPEECH, LANGUAGE, GESTURE, REASONER = (spec.name for spec in (SPEECH_NODE, LANGUAGE_NODE, GESTURE_NODE, REASONER_NODE))
_PICTURES = (topics.RGB.name, topics.RGB.stored_name)
_DEPTHS = (topics.DEPTH.name, topics.DEPTH.stored_name)
_LONG_AGO_S = float("-inf")


@dataclass(slots=True)
class PictureCounts:
    """How many pictures were shown, and how many of them were examined."""

    pictures: int = 0
    examined: int = 0


class Lockstep:
    """Feeds one bag to the graph. Events of the monitor must be passed to `on_event` from another thread."""

    def __init__(
        self,
        bag: BagReader,
        player: PlayerNode,
        monitor: MonitorNode,
        check: Callable[[], None],
        note: Callable[[str], None],
        options: LockstepOptions = LOCKSTEP,
    ) -> None:
        """Nothing is played yet.

        Args:
            bag: what to play.
            player: publishes it.
            monitor: hears what the nodes publish; another thread must spin it.
            check: raises GraphError when a node has died; called while waiting.
            note: gets warnings, a line each.
            options: limits of the waits.
        """
        self._bag = bag
        self._options = options
        self._player = player
        self._monitor = monitor
        self._check = check
        self._note = note
        self._delivery = DeliveryConfirmation(monitor, NODES, check, options)
        self._outputs = NodeOutputs(check)
        self._settle = {name: monitor.create_client(Trigger, f"/{name}/settle") for name in (SPEECH, GESTURE, REASONER)}
        self._last_hands_s = float("-inf")
        self._image_s = self._depth_s = _LONG_AGO_S  # stamps of the last ones that were shown
        self._subscribers = TopicSubscribers(bag, player, monitor)
        self.counts = PictureCounts()
        self._silence = player.create_publisher(AudioDataStamped, topics.AUDIO.name, 500)

    def on_event(self, event: Event) -> None:
        """Take note of an event of the monitor."""
        self._outputs.add(event)

    def missing_nodes(self) -> list[str]:
        """Return the nodes that are not up yet."""
        missing = {*self._delivery.missing_nodes(), *self._subscribers.missing_nodes()}
        missing.update(name for name, client in self._settle.items() if not client.service_is_ready())
        return sorted(missing)

    def run(self, rate: float | None = None, progress: Callable[[float], None] = lambda _: None) -> None:
        """Play the bag once, at most `rate` times as fast as it was recorded (None: as fast as the nodes answer).

        Raises:
            GraphError: a node died or does not answer.
            BagError: the bag is damaged from its first message on.
        """
        wanted = self._subscribers.find()
        self._publish_first(wanted)
        begin = time.monotonic()
        sounds: deque[BagMessage] = deque(maxlen=2)
        depths = [name for name in _DEPTHS if name in wanted]
        for message in with_depth_first(self._bag.messages(wanted), _PICTURES, depths, self._options.depth_delay_ns):
            offset_s = 1e-9 * (message.time_ns - self._bag.start_ns)
            while rate is not None and (ahead_s := offset_s / rate - (time.monotonic() - begin)) > 0.0:
                self._check()
                time.sleep(min(ahead_s, 0.2))
            self._step(message)
            progress(offset_s)
            if message.topic.name == topics.AUDIO.name:
                sounds.append(message)
        self._play_silence([deserialize_message(message.data, AudioDataStamped) for message in sounds])

    def _publish_first(self, wanted: Sequence[str]) -> None:
        """Say first what a late listener would hear at once, and wait until every publisher was found."""
        latched = {topic.name for topic in self._bag.topics if topic.latched} | {topics.AUDIO_INFO.name}
        first = latched | {topics.RGB_INFO.name, topics.DEPTH_INFO.name}
        deadline = time.monotonic() + self._options.answer_timeout_s
        while late := [
            name for name in wanted if self._player.subscription_count(name) < len(self._subscribers.subscribers(name))
        ]:
            self._check()
            if time.monotonic() > deadline:
                raise GraphError("the graph", f"does not take {', '.join(late)}")
            time.sleep(0.02)
        self._player.tell_time(self._bag.start_ns)
        todo = [name for name in wanted if name in first]
        for message in self._bag.messages(todo) if todo else ():
            if message.topic.name in todo:
                todo.remove(message.topic.name)
                self._publish(message)
            if not todo:
                break
        self._player.wait_until_taken(self._options.quiet_timeout_s)
        self._delivery.wait_until_processed(*NODES, rounds=1)
        offered = len(self._monitor.get_publishers_info_by_topic(_VOCABULARY))
        deadline = time.monotonic() + self._options.quiet_timeout_s
        while self._await_settled(SPEECH)[0] < offered and time.monotonic() < deadline:
            time.sleep(0.01)

    def _publish(self, message: BagMessage) -> None:
        self._player.publish(message)
        for name in self._subscribers.nodes_of(message.topic.name):
            if self._delivery.count_sent(name, message.topic.name) >= self._options.max_pending:
                self._delivery.wait_until_processed(name)

    def _step(self, message: BagMessage) -> None:
        self._player.tell_time(message.time_ns)
        name = message.topic.name
        self._publish(message)
        if name in _DEPTHS:
            self._depth_s = 1e-9 * read_stamp_ns(message.data)
            self._await_depth()
        elif name in _PICTURES:
            self._image_s = 1e-9 * read_stamp_ns(message.data)
            self._await_hands()
        elif name == topics.AUDIO.name:
            self._await_speech()

    def _await_depth(self) -> None:
        """Let gesture_node have a depth image before the picture that it belongs to."""
        depth_s = self._depth_s if self._subscribers.subscribes(GESTURE, _DEPTHS) else _LONG_AGO_S
        self._await_settled(
            GESTURE, lambda numbers: numbers[1] >= depth_s - self._options.stamp_tolerance_s, "a depth image"
        )

    def _await_hands(self) -> None:
        """Wait until the picture was examined; decisions may follow."""
        self.counts.pictures += 1
        before = self.counts.examined  # what was lost on its way once is not waited for again
        hands_s, _, examined = self._await_settled(GESTURE, lambda numbers: numbers[2] > before, "a picture")
        self.counts.examined = int(examined)
        if not self._outputs.wait(
            lambda: self._outputs.hands_s >= hands_s - self._options.stamp_tolerance_s, self._options.answer_timeout_s
        ):
            raise GraphError(
                GESTURE, f"has told of hands that have not come for {self._options.answer_timeout_s:.0f} s"
            )
        self._last_hands_s = hands_s
        self._await_decisions()

    def _await_settled(
        self, node: str, ready: Callable[[tuple[float, ...]], bool] = lambda _: True, what: str = ""
    ) -> tuple[float, ...]:
        """Wait until a node has done all it can do with what it was sent; returns the numbers that it tells.

        `ready` tells by them whether it has all that it was sent; what does not come is noted as lost on the way.
        """
        self._delivery.wait_until_processed(node, rounds=2)
        start = time.monotonic()
        while True:
            answer = self._delivery.call_service(node, self._settle[node], Trigger.Request())
            numbers = tuple(float(word) for word in answer.message.split())
            waited_s = time.monotonic() - start
            if answer.success and ready(numbers):
                return numbers
            if answer.success and waited_s > self._options.image_timeout_s:
                self._note(f"warning: {what} has not reached {node}")
                return numbers
            self._check()
            if waited_s > self._options.answer_timeout_s:
                raise GraphError(node, f"has been busy for {self._options.answer_timeout_s:.0f} s")
            time.sleep(0.002)

    def _await_speech(self) -> None:
        """Let speech_node examine the sound, and what it heard be understood, before time goes on."""
        self._await_settled(SPEECH)
        while self._outputs.transcripts:
            self._delivery.wait_until_processed(LANGUAGE, rounds=2)
            self._await_commands(*self._outputs.transcripts.pop(0))
            self._outputs.speech_changed = True
        if self._outputs.speech_changed:
            # Speech makes these two attentive: they must know of it before the next picture.
            self._outputs.speech_changed = False
            self._delivery.wait_until_processed(GESTURE, REASONER, rounds=2)
        self._await_decisions()

    def _await_commands(self, utterance: str, text: str) -> None:
        # language_node answers every transcript, if only to refuse it.
        timeout_s = self._options.answer_timeout_s
        if not self._outputs.wait(lambda: self._outputs.is_answered(utterance), timeout_s):
            raise GraphError(LANGUAGE, f'has not answered "{text}" for {timeout_s:.0f} s')

    def _await_decisions(self) -> None:
        """Let the reasoner do all it can do with what was played so far, while there is anything to decide."""
        if not self._outputs.undecided():
            return
        image_s = self._image_s if self._subscribers.subscribes(REASONER, _PICTURES) else _LONG_AGO_S
        depth_s = self._depth_s if self._subscribers.subscribes(REASONER, _DEPTHS) else _LONG_AGO_S
        # Hands come from another node, and images may be overtaken on their way.
        sent = (self._last_hands_s, image_s, depth_s)
        self._await_settled(
            REASONER,
            lambda numbers: all(
                has >= due - self._options.stamp_tolerance_s for has, due in zip(numbers, sent, strict=True)
            ),
            "what was shown last",
        )

    def _play_silence(self, sounds: Sequence[AudioDataStamped]) -> None:
        """Let time go on, in silence, until everything heard is answered: the last word needs its end."""
        if not sounds:
            return
        sound, stamps = sounds[-1], [seconds_from_msg(sound.header.stamp) for sound in sounds]
        length_s = stamps[-1] - stamps[0] if 0.0 < stamps[-1] - stamps[0] < 1.0 else self._options.silence_chunk_s
        sound.audio.data = bytes(len(sound.audio.data))
        end_s = stamps[-1] + length_s
        bag_end_s = 1e-9 * self._bag.start_ns + self._bag.duration_s
        for number in range(int(self._options.max_silence_s / length_s)):
            if not self._outputs.undecided() and self._silent_since_s() >= end_s:
                return
            self._player.tell_time(int(1e9 * (bag_end_s + (number + 1) * length_s)))
            sound.header.stamp = time_to_msg(end_s + number * length_s)
            self._silence.publish(sound)
            self._delivery.count_sent(SPEECH, topics.AUDIO.name)
            self._await_speech()
        for text in self._outputs.undecided():
            self._note(f'warning: {REASONER} has not decided on "{text}"')

    def _silent_since_s(self) -> float:
        status = self._monitor.record().last(run_record.SPEECH_STATUS)
        if status is None or status.data["state"] != run_record.SPEECH_IDLE:
            return float("-inf")
        return status.stamp_s
