# SPDX-License-Identifier: Apache-2.0
"""speech_node and language_node over real DDS: sound in, commands out."""

from __future__ import annotations

import threading

import numpy as np
import pytest
import rclpy
from audio_common_msgs.msg import AudioData, AudioDataStamped, AudioInfo
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from simulated_speech import say
from uncom_common.conversions import header_to_msg, seconds_from_msg
from uncom_language.conversions import vocabulary_to_msg
from uncom_language.exceptions import UnknownBackendError
from uncom_language.language_node import LanguageNode
from uncom_language.speech_node import SpeechNode

from uncom_interfaces.msg import Command, SpeechStatus, Transcript, Vocabulary

DOMAIN = 50
START_S = 1000.0


class Graph:
    """Both nodes and a probe that plays sound and collects what comes out."""

    def __init__(self):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.speech = SpeechNode(context=self.context)
        self.language = LanguageNode(context=self.context)
        self.probe = Node("probe", context=self.context)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.info = self.probe.create_publisher(AudioInfo, "/audio_info", latched)
        self.audio = self.probe.create_publisher(AudioDataStamped, "/audio", 500)
        self.transcripts, self.commands, self.statuses = [], [], []
        self.changed = threading.Condition()
        for kind, topic, kept in (
            (Transcript, "/uncom/transcript", self.transcripts),
            (Command, "/uncom/command", self.commands),
            (SpeechStatus, "/uncom/speech_status", self.statuses),
        ):
            self.probe.create_subscription(kind, topic, lambda msg, kept=kept: self._keep(kept, msg), 100)
        self.executor = MultiThreadedExecutor(num_threads=2, context=self.context)
        for node in (self.speech, self.language, self.probe):
            self.executor.add_node(node)
        self.thread = threading.Thread(target=self.executor.spin, daemon=True)
        self.thread.start()
        self.now_s = START_S
        self.wait(lambda: self.audio.get_subscription_count() and self.language.count_publishers("/uncom/transcript"))
        self.wait(
            lambda: self.probe.count_publishers("/uncom/command") and self.probe.count_publishers("/uncom/transcript")
        )

    def _keep(self, kept, msg):
        with self.changed:
            kept.append(msg)
            self.changed.notify_all()

    def wait(self, condition, timeout_s=60.0):
        with self.changed:
            # The condition may hang on discovery, which notifies nobody: look again now and then.
            for _ in range(round(timeout_s / 0.05)):
                if condition():
                    return
                self.changed.wait(0.05)
        raise TimeoutError

    def play(self, samples, rate=16000, chunk_s=0.05):
        """Play samples (N,) or (N, channels); return the time [s] of the first one."""
        start = self.now_s
        step = round(chunk_s * rate)
        for position in range(0, len(samples), step):
            piece = samples[position : position + step]
            msg = AudioDataStamped(header=header_to_msg(self.now_s, "mic"))
            msg.audio = AudioData(data=piece.astype("<i2").tobytes())
            self.audio.publish(msg)
            self.now_s += len(piece) / rate
        return start

    def hear(self, samples, **options):
        """Play sound and return the commands that all of it gave."""
        before = len(self.commands)
        heard_before = len(self.transcripts)
        start = self.play(samples, **options)
        self.wait(
            lambda: (
                self.statuses
                and self.statuses[-1].state == SpeechStatus.IDLE
                and seconds_from_msg(self.statuses[-1].header.stamp) > self.now_s - 1.1
                and len({c.utterance_id for c in self.commands[before:]}) == len(self.transcripts[heard_before:])
            )
        )
        return start, self.commands[before:]

    def close(self):
        self.executor.shutdown(timeout_sec=5.0)
        self.thread.join(timeout=5.0)
        for node in (self.speech, self.language, self.probe):
            node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture(scope="module")
def graph():
    made = Graph()
    yield made
    made.close()


def silence(seconds, rng=None):
    rng = rng or np.random.default_rng(0)
    return rng.normal(0, 3, round(16000 * seconds)).astype(np.int16)


def test_a_spoken_sentence_becomes_a_command_with_the_times_of_its_words(graph):
    spoken = say("take the lemon and put it in this bowl", snr_db=25, tail_s=2.0)
    start, commands = graph.hear(spoken.samples)
    (command,) = commands
    assert (command.act, command.primitive, command.relation) == (
        Command.ACT_COMMAND,
        Command.PRIMITIVE_PUT_IN,
        "in",
    )
    assert command.object.text == "lemon"
    assert command.target.deictic == "this"
    # "take the lemon and put it in this bowl": word 7 is "this"
    assert seconds_from_msg(command.target.deictic_start) - start == pytest.approx(spoken.starts[7], abs=0.12)
    assert "pocketsphinx" in graph.transcripts[-1].backend
    assert "grammar" in command.backend


def test_a_greeting_is_heard_and_refused_politely(graph):
    _, commands = graph.hear(say("hello there", snr_db=25, tail_s=2.0).samples)
    (command,) = commands
    assert command.act == Command.ACT_REFUSED
    assert command.reason
    assert not command.object.present


def test_two_utterances_one_after_another_give_two_commands(graph):
    sound = np.concatenate(
        [
            say("pick up the red cup", tail_s=1.0).samples,
            say("put the banana to the left of the box", tail_s=2.0).samples,
        ]
    )
    _, commands = graph.hear(sound)
    assert [command.primitive for command in commands] == [Command.PRIMITIVE_PICK, Command.PRIMITIVE_PLACE]
    assert commands[0].utterance_id != commands[1].utterance_id


def test_silence_and_noise_give_neither_transcript_nor_command(graph):
    rng = np.random.default_rng(3)
    time = np.arange(3 * 16000) / 16000
    tone = 3000 * np.sin(2 * np.pi * 440 * time)
    before = len(graph.transcripts)
    for sound in (silence(3.0), rng.normal(0, 1500, 3 * 16000), tone):
        _, commands = graph.hear(np.concatenate([np.asarray(sound), silence(2.0)]).astype(np.int16))
        assert commands == []
    assert len(graph.transcripts) == before


def test_words_that_are_offered_on_a_topic_are_heard(graph):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    offered = graph.probe.create_publisher(Vocabulary, "/uncom/vocabulary", latched)
    graph.wait(lambda: offered.get_subscription_count() == 2)
    offered.publish(vocabulary_to_msg({"widgeon": "W IH JH AH N"}, 0.0))
    graph.hear(silence(3.0))
    _, (command,) = graph.hear(say("put the widgeon in the bowl", tail_s=2.0).samples)
    assert (command.object.text, command.target.text) == ("widgeon", "bowl")


def test_an_answer_without_a_verb_is_a_fragment_and_a_correction_holds_what_changes(graph):
    _, (fragment,) = graph.hear(say("the red one", tail_s=2.0).samples)
    assert (fragment.act, fragment.object.text, list(fragment.object.modifiers)) == (
        Command.ACT_FRAGMENT,
        "red one",
        ["red"],
    )
    _, (correction,) = graph.hear(say("a bit to the left", tail_s=2.0).samples)
    assert (correction.act, correction.relation) == (Command.ACT_CORRECTION, "left_of")
    assert correction.distance_m == pytest.approx(0.05)


def test_status_tells_up_to_when_sound_was_examined(graph):
    graph.hear(silence(3.0))
    stamps = [seconds_from_msg(status.header.stamp) for status in graph.statuses]
    assert stamps[-1] > graph.now_s - 1.1


@pytest.mark.parametrize("node", [SpeechNode, LanguageNode])
def test_a_back_end_that_does_not_exist_is_a_clear_error(graph, node):
    with pytest.raises(UnknownBackendError, match="'wisper' is not available"):
        node(context=graph.context, parameter_overrides=[Parameter("backend", value="wisper")])
