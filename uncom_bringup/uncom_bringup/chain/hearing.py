# SPDX-License-Identifier: Apache-2.0
"""What the chained cores hear of a recording, and when the eyes are told of it: speech makes them attentive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from uncom_language.back_end_factory import end_of_turn_pause_from_config
from uncom_language.config import SpeechConfig
from uncom_language.speech.recognition.recognizer import Recognizer
from uncom_language.speech.speech_status import SpeechState, SpeechStatus
from uncom_language.speech.streaming_transcriber import StreamingTranscriber, TranscriberOptions
from uncom_language.types import Transcript
from uncom_perception.hands.pointing_attention import expected_after_speech, expected_after_words

from uncom_bringup.chain.recording import Recording

_CHUNK_S = 0.05  # as the robot's audio driver sends it
_QUIET_S = 1.0
_PATIENCE_S = 600.0


@dataclass(frozen=True, slots=True)
class Attention:
    """From at_s [s] on a pointing hand is expected until until_s [s], as gesture_node does when it is told."""

    at_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class Heard:
    """Utterances, their ids counted from 1, and when they made the eyes attentive, in order of time."""

    transcripts: tuple[Transcript, ...]
    attention: tuple[Attention, ...]


def hear(recognizer: Recognizer, speech: SpeechConfig, attention_s: float, recording: Recording) -> Heard:
    """Let a recogniser hear a recording in the chunks of the robot's driver.

    Args:
        recognizer: of the speech.
        speech: parameters of speech_node.
        attention_s: of gesture_node.
        recording: whose sound is heard, and some quiet after it, so that the last word has its end.
    """
    transcripts, attention = list[Transcript](), list[Attention]()
    now_s = recording.sound_start_s

    def on_transcript(transcript: Transcript) -> None:
        transcripts.append(transcript)
        words, end_s = (word.text for word in transcript.words), transcript.words[-1].end_s
        until_s = expected_after_words(words, end_s, attention_s)
        if until_s > float("-inf"):
            attention.append(Attention(now_s, until_s))

    def on_status(status: SpeechStatus) -> None:
        if status.state is SpeechState.SPEECH:
            attention.append(Attention(now_s, expected_after_speech(status.examined_until_s, attention_s)))

    options = TranscriberOptions(
        speech.endpointer(), "utterance", speech.backlog_s, end_of_turn_pause_from_config(speech)
    )
    listener = StreamingTranscriber(lambda: recognizer, on_transcript, on_status, options)
    rate = recording.sample_rate
    sound = np.concatenate([recording.samples, np.zeros(round(_QUIET_S * rate), np.int16)])
    step = round(_CHUNK_S * rate)
    listener.start()
    try:
        for first in range(0, len(sound), step):
            chunk = sound[first : first + step]
            now_s = recording.sound_start_s + (first + len(chunk)) / rate
            listener.feed(chunk, rate, recording.sound_start_s + first / rate)
            listener.wait_until_idle(_PATIENCE_S)  # so that nothing waits or is dropped, however slow the machine is
    finally:
        listener.stop()
    return Heard(tuple(transcripts), tuple(attention))
