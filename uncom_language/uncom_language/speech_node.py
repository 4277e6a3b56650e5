# SPDX-License-Identifier: Apache-2.0
"""speech_node: /audio in, /uncom/transcript and /uncom/speech_status out."""

from __future__ import annotations

import sys
import uuid
from typing import Any

import numpy as np
import numpy.typing as npt
from audio_common_msgs.msg import AudioDataStamped, AudioInfo
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger
from uncom_common.configured_node import ConfiguredNode, run_node
from uncom_common.conversions import seconds_from_msg

from uncom_interfaces.msg import SpeechStatus as SpeechStatusMsg
from uncom_interfaces.msg import Transcript as TranscriptMsg
from uncom_interfaces.msg import Vocabulary as VocabularyMsg
from uncom_language.back_end_factory import end_of_turn_pause_from_config, recognizer_from_config
from uncom_language.config import SpeechConfig
from uncom_language.conversions import speech_status_to_msg, transcript_to_msg, vocabulary_from_msg
from uncom_language.exceptions import LanguageError, SoundFormatError
from uncom_language.speech.audio.microphone import Microphone
from uncom_language.speech.audio.samples import decode_samples
from uncom_language.speech.recognition.recognizer import Recognizer
from uncom_language.speech.recognizer_factory import check_backend
from uncom_language.speech.speech_status import SpeechStatus
from uncom_language.speech.streaming_transcriber import StreamingTranscriber, TranscriberOptions
from uncom_language.types import Transcript


class SpeechNode(ConfiguredNode[SpeechConfig]):
    """Hears utterances in a stream of sound. Recognition runs in a worker thread, never in a callback."""

    def __init__(self, **node_options: Any) -> None:
        """Declare parameters, topics and start loading the recogniser.

        Raises:
            UnknownBackendError: the parameter `backend` or `language` names none that works.
            MicrophoneError: a microphone is asked for and there is none.
        """
        super().__init__("speech_node", SpeechConfig, **node_options)
        config = self.config
        check_backend(config.backend, config.language)
        self._format = (config.sample_rate, config.channels, config.sample_format)
        self._transcripts = self.create_publisher(TranscriptMsg, "/uncom/transcript", 10)
        latched = QoSProfile(
            depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
        )
        self._statuses = self.create_publisher(SpeechStatusMsg, "/uncom/speech_status", 10)
        options = TranscriberOptions(
            config.endpointer(),
            f"utterance-{uuid.uuid4().hex[:8]}",
            config.backlog_s,
            end_of_turn_pause_from_config(config),
        )
        self._transcriber = StreamingTranscriber(self._load, self._heard, self._status, options)
        self._transcriber.start()
        offered = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(VocabularyMsg, "/uncom/vocabulary", self._on_vocabulary, offered)
        self._vocabularies = 0
        self.create_service(Trigger, "~/settle", self._on_settle)
        self.create_subscription(AudioInfo, "/audio_info", self._on_info, latched)
        self._microphone: Microphone | None = None
        if config.microphone == "off":
            self.create_subscription(AudioDataStamped, config.audio_topic, self._on_audio, 500)
        else:
            self._microphone = Microphone("" if config.microphone == "default" else config.microphone)
            self._microphone.start(self._on_block)
            self.get_logger().info(f"listening to the microphone {self._microphone.name!r}")

    def _load(self) -> Recognizer:
        recognizer = recognizer_from_config(self.config)
        self.get_logger().info(f"hearing with {recognizer.backend}")
        return recognizer

    def _on_vocabulary(self, msg: VocabularyMsg) -> None:
        self._vocabularies += 1
        try:
            self._transcriber.add_words(vocabulary_from_msg(msg))
        except LanguageError as error:
            self.get_logger().error(str(error))

    def _on_info(self, msg: AudioInfo) -> None:
        self._format = (
            int(msg.sample_rate) or self.config.sample_rate,
            int(msg.channels) or self.config.channels,
            msg.sample_format or self.config.sample_format,
        )

    def _on_audio(self, msg: AudioDataStamped) -> None:
        rate, channels, sample_format = self._format
        try:
            samples = decode_samples(bytes(msg.audio.data), sample_format, channels)
            stamp_s = seconds_from_msg(msg.header.stamp)
            if stamp_s == 0.0:  # a sender without a clock: its sound ended just now
                stamp_s = self.get_clock().now().nanoseconds * 1e-9 - samples.size / rate
            self._transcriber.feed(samples, rate, stamp_s)
        except SoundFormatError as error:
            self.get_logger().error(str(error), throttle_duration_sec=5.0)

    def _on_block(self, samples: npt.NDArray[np.int16], age_s: float) -> None:
        if self._microphone is not None:
            self._transcriber.feed(
                samples, self._microphone.sample_rate, self.get_clock().now().nanoseconds * 1e-9 - age_s
            )

    def _on_settle(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Tell whether all sound that came was examined; the message is how many vocabularies came.

        Whoever plays a bag holds it for that, so that no answer depends on the pace.
        """
        response.success = self._transcriber.idle
        response.message = str(self._vocabularies)
        return response

    def _heard(self, transcript: Transcript) -> None:
        self.get_logger().info(f"heard: {transcript.text}")
        self._transcripts.publish(transcript_to_msg(transcript))

    def _status(self, status: SpeechStatus) -> None:
        self._statuses.publish(speech_status_to_msg(status))

    def destroy_node(self) -> None:
        """Stop the worker, then the node."""
        if self._microphone is not None:
            self._microphone.stop()
        self._transcriber.stop()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the node."""
    sys.exit(run_node(SpeechNode, args))


if __name__ == "__main__":
    main()
