# SPDX-License-Identifier: Apache-2.0
"""The listener on simulated speech: decoding while sound arrives, pauses, new words, bounded memory."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from simulated_speech import say
from uncom_language.exceptions import RecognizerError, SoundFormatError
from uncom_language.parser.end_of_turn import end_of_turn_pause_s
from uncom_language.speech import make_recognizer
from uncom_language.speech.endpointing.options import EndpointerOptions
from uncom_language.speech.pocketsphinx.pocketsphinx_recognizer import PocketSphinxRecognizer
from uncom_language.speech.streaming_transcriber import StreamingTranscriber, TranscriberOptions

RATE = 16000
QUICK_S, FULL_S = 0.18, 0.6


class Ear:
    """A listener with what it reported; the time [s] of the sound at each transcript."""

    def __init__(self, patience=True, recognizer=make_recognizer, backlog_s=120.0):
        self.transcripts, self.at_s, self.statuses = [], [], []
        self.clock_s = 0.0
        options = TranscriberOptions(
            EndpointerOptions(hang_over_s=FULL_S),
            "test",
            backlog_s,
            (lambda words: end_of_turn_pause_s(words, QUICK_S, FULL_S)) if patience else None,
        )
        self.listener = StreamingTranscriber(recognizer, self._keep, self.statuses.append, options)
        self.listener.start()

    def _keep(self, transcript):
        self.transcripts.append(transcript)
        self.at_s.append(self.clock_s)

    def hear(self, samples, chunk_s=0.05):
        step = round(chunk_s * RATE)
        for position in range(0, len(samples), step):
            self.listener.feed(samples[position : position + step], RATE, self.clock_s)
            assert self.listener.wait_until_idle(60.0)
            self.clock_s += step / RATE
        return [transcript.text for transcript in self.transcripts]


@pytest.fixture
def ear():
    made = Ear()
    yield made
    made.listener.stop()


def end_of_speech_s(text):
    loud = np.abs(say(text).samples.astype(float))
    return np.flatnonzero(loud > 0.02 * loud.max())[-1] / RATE


def test_a_whole_command_is_known_soon_after_its_last_word(ear):
    text = "put the banana to the left of the box"
    assert ear.hear(say(text, snr_db=25, tail_s=1.5).samples) == [text]
    assert ear.at_s[0] - end_of_speech_s(text) < 0.3
    assert ear.transcripts[0].latency_s < 1.0


def test_a_pause_before_the_place_does_not_cut_a_command_in_two(ear):
    first, second = say("put the banana", tail_s=0.0).samples, say("in the bowl", lead_s=0.35, tail_s=1.2).samples
    sound = np.concatenate([first, second]) + np.random.default_rng(1).normal(0, 20, len(first) + len(second))
    assert ear.hear(sound.astype(np.int16)) == ["put the banana in the bowl"]


def test_words_and_times_are_the_same_however_the_sound_is_cut():
    sound = say("take the lemon and put it in this bowl", snr_db=25).samples
    heard = []
    for chunk_s in (0.02, 0.3):
        ear = Ear()
        ear.hear(sound, chunk_s)
        ear.listener.stop()
        heard.append(ear.transcripts[0].words)
    assert [word.text for word in heard[0]] == [word.text for word in heard[1]]
    # A tie in the decoder's lattice may fall either way by a frame.
    assert max(abs(a.start_s - b.start_s) for a, b in zip(*heard, strict=True)) < 0.03


@pytest.mark.parametrize(
    ("shorter", "longer"),
    [
        ("put the cup on the plate", "put the cup on the"),
        ("put the cup on the red plate", "put the cup on the red"),
        ("take this mug and put it here", "take this mug"),
        ("stop", "no"),
        ("put it on this plate", "put it on this"),
        ("give me the spoon", "give me"),
        ("put it to the left of the box", "put it to the left"),
    ],
)
def test_half_a_command_is_waited_for_longer_than_a_whole_one(shorter, longer):
    assert end_of_turn_pause_s(shorter, QUICK_S, FULL_S) == QUICK_S
    assert end_of_turn_pause_s(longer, QUICK_S, FULL_S) > 1.5 * QUICK_S


def test_words_that_are_offered_are_heard_from_then_on():
    ear = Ear(recognizer=PocketSphinxRecognizer)
    ear.listener.add_words({"gizmo": "G IH Z M OW", "flange": ""})
    try:
        assert ear.hear(say("put the gizmo next to the flange", snr_db=25).samples) == [
            "put the gizmo next to the flange"
        ]
    finally:
        ear.listener.stop()


def test_a_word_is_learnt_once_and_a_wrong_pronunciation_is_an_error():
    recognizer = PocketSphinxRecognizer()
    assert recognizer.add_words({"lemon": "", "zorkmid": "Z AO R K M IH D", "toy truck": ""}) == ("zorkmid", "truck")
    assert recognizer.add_words({"zorkmid": ""}) == ()
    with pytest.raises(RecognizerError, match="no pronunciation"):
        recognizer.add_words({"blorb": "B QQ"})


def test_bad_sound_is_refused_where_it_is_fed(ear):
    with pytest.raises(SoundFormatError, match="sample rate"):
        ear.listener.feed(np.zeros(10, np.int16), 10, 0.0)
    with pytest.raises(SoundFormatError, match="int16 or float32"):
        ear.listener.feed(np.zeros(10, np.int64), RATE, 0.0)


def test_sound_that_waits_too_long_is_dropped_and_said_to_be():
    ear = Ear(recognizer=PocketSphinxRecognizer, backlog_s=2.0)  # loads while the sound comes in
    for second in range(10):
        ear.listener.feed(np.zeros(RATE, np.int16), RATE, float(second))
    assert ear.listener.wait_until_idle(60.0)
    ear.listener.stop()
    assert ear.statuses[-1].rejected == 8
    assert "too slow" in ear.statuses[-1].last_rejection


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.slow
def test_an_hour_of_sound_takes_no_more_memory_than_its_first_minutes():
    ear = Ear()
    rng = np.random.default_rng(2)
    spoken = say("put the cup on the plate", snr_db=25, tail_s=0.5).samples
    block = rng.normal(0, 30, 60 * RATE).astype(np.int16)
    sizes = []
    for minute in range(60):
        if minute % 10 == 0:
            block[: spoken.size] = spoken
        else:
            block[: spoken.size] = rng.normal(0, 30, spoken.size)
        ear.hear(block, 0.5)
        sizes.append(resident_mb())
    ear.listener.stop()
    assert len(ear.transcripts) == 6
    assert sizes[-1] - sizes[11] < 10.0
