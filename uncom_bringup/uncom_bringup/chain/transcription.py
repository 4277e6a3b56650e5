# SPDX-License-Identifier: Apache-2.0
"""From the sound of a recording to transcripts, and when speech makes the gesture reader expect a pointing hand."""

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

from uncom_bringup.chain.options import TRANSCRIPTION, TranscriptionOptions
from uncom_bringup.chain.recording import Recording


@dataclass(frozen=True, slots=True)
class Attention:
    """From at_s [s] on a pointing hand is expected until until_s [s], as in the gesture node."""

    at_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class Transcription:
    """Utterances, their ids counted from 1, and when a pointing hand is expected for them, in order of time."""

    transcripts: tuple[Transcript, ...]
    attention: tuple[Attention, ...]


def transcribe(
    recognizer: Recognizer,
    speech: SpeechConfig,
    attention_s: float,
    recording: Recording,
    options: TranscriptionOptions = TRANSCRIPTION,
) -> Transcription:
    """Transcribe a recording in the chunks of the robot's driver, as the speech node does.

    Args:
        recognizer: of the speech.
        speech: parameters of speech_node.
        attention_s: of gesture_node.
        recording: whose sound is heard, and some quiet after it, so that the last word has its end.
        options: of the chunks.
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

    pause = end_of_turn_pause_from_config(speech)
    transcriber_options = TranscriberOptions(speech.endpointer(), "utterance", speech.backlog_s, pause)
    transcriber = StreamingTranscriber(lambda: recognizer, on_transcript, on_status, transcriber_options)
    rate = recording.sample_rate
    sound = np.concatenate([recording.samples, np.zeros(round(options.quiet_s * rate), np.int16)])
    step = round(options.chunk_s * rate)
    transcriber.start()
    try:
        for first in range(0, len(sound), step):
            chunk = sound[first : first + step]
            now_s = recording.sound_start_s + (first + len(chunk)) / rate
            transcriber.feed(chunk, rate, recording.sound_start_s + first / rate)
            transcriber.wait_until_idle(options.max_wait_s)
    finally:
        transcriber.stop()
    return Transcription(tuple(transcripts), tuple(attention))
