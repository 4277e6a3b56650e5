# SPDX-License-Identifier: Apache-2.0
"""Cutting a stream into utterances."""

from __future__ import annotations

import numpy as np
import pytest
import soxr
from simulated_speech import say
from uncom_common.exceptions import InvalidConfigError
from uncom_language.exceptions import SoundFormatError
from uncom_language.speech.audio.samples import decode_samples
from uncom_language.speech.endpointing.endpointer import Endpointer
from uncom_language.speech.endpointing.options import EndpointerOptions
from uncom_language.speech.pocketsphinx.noise_floor import add_noise_floor

RATE = 16000


def hush(seconds, seed=0, level=4.0):
    return np.random.default_rng(seed).normal(0, level, round(RATE * seconds)).astype(np.int16)


def cut(sound, chunk=800, rate=RATE, start_s=0.0, stream=None):
    stream = stream or Endpointer(sample_rate=rate)
    segments = []
    for position in range(0, len(sound), chunk):
        segments += stream.feed(sound[position : position + chunk], start_s + position / rate)
    return segments + stream.flush()


def spoken(text="take the lemon and put it in this bowl", **options):
    made = say(text, **options)
    return np.clip(made.samples + hush(len(made.samples) / RATE)[: len(made.samples)], -32768, 32767).astype(
        np.int16
    ), made


@pytest.mark.parametrize("chunk", [41, 480, 800, 16000, 200000])
def test_chunks_of_any_size_give_the_same_utterances(chunk):
    sound, _ = spoken()
    (whole,) = cut(sound, chunk=len(sound))
    (cut_up,) = cut(sound, chunk=chunk)
    assert np.array_equal(whole.samples, cut_up.samples)
    assert cut_up.start_s == pytest.approx(whole.start_s, abs=1e-3)


@pytest.mark.parametrize("text", ["take the lemon", "put it here", "pick up the cup", "stop", "hand me the spoon"])
def test_the_first_word_is_whole(text):
    sound, made = spoken(text, lead_s=1.0)
    (segment,) = cut(sound)
    assert 0.1 <= made.starts[0] - segment.start_s <= 0.6


def test_a_pause_of_half_a_second_does_not_split_a_command():
    first, second = say("take the lemon", lead_s=1.0, tail_s=0.25), say("and put it here", lead_s=0.25, tail_s=2.0)
    sound = np.concatenate([first.samples, second.samples])
    sound = (sound + hush(len(sound) / RATE)[: len(sound)]).astype(np.int16)
    assert len(cut(sound)) == 1


def test_utterances_one_after_another_are_told_apart_and_keep_their_times():
    first, second = say("take the lemon", tail_s=1.5), say("put it here", tail_s=1.5)
    sound = np.concatenate([first.samples, second.samples])
    sound = (sound + hush(len(sound) / RATE)[: len(sound)]).astype(np.int16)
    segments = cut(sound, start_s=500.0)
    assert len(segments) == 2
    assert segments[1].start_s == pytest.approx(500.0 + len(first.samples) / RATE + second.starts[0], abs=0.45)


@pytest.mark.parametrize(("rate", "channels"), [(8000, 1), (44100, 2), (48000, 6), (22050, 1)])
def test_any_rate_and_channel_count_is_taken(rate, channels):
    sound, _ = spoken()
    (expected,) = cut(sound)
    other = soxr.resample(sound.astype(np.float32) / 32768, RATE, rate)
    (segment,) = cut(np.repeat(other[:, None], channels, axis=1), chunk=1000, rate=rate)
    assert segment.start_s == pytest.approx(expected.start_s, abs=0.1)
    assert len(segment.samples) == pytest.approx(len(expected.samples), abs=0.25 * RATE)


def test_silence_and_steady_noise_are_no_utterance():
    noise = np.random.default_rng(1).normal(0, 2000, 8 * RATE).astype(np.int16)
    hum = (3000 * np.sin(2 * np.pi * 50 * np.arange(8 * RATE) / RATE)).astype(np.int16)
    for sound in (np.zeros(8 * RATE, np.int16), hush(8.0), noise, hum):
        assert cut(sound) == []


def test_endless_speech_is_cut_and_memory_stays_bounded():
    sound, _ = spoken("the banana and the apple and the lemon and the orange and the pear", lead_s=0.0, tail_s=0.0)
    config = EndpointerOptions(max_length_s=3.0, hang_over_s=2.0)
    stream = Endpointer(config)
    segments = cut(np.tile(sound, 10), stream=stream)
    assert all(len(segment.samples) <= 3.1 * RATE for segment in segments)


def test_a_gap_in_the_stamps_ends_the_utterance():
    sound, _ = spoken(lead_s=0.5)
    half = len(sound) // 2
    stream = Endpointer()
    assert stream.feed(sound[:half], 10.0) == []
    (segment,) = stream.feed(hush(1.0), 60.0)
    assert segment.end_s < 10.0 + half / RATE + 0.1
    assert stream.now_s == pytest.approx(61.0, abs=0.1)


def test_digital_silence_between_words_gets_a_floor_and_real_noise_is_left_alone():
    clean = say("put it here").samples
    assert np.std(add_noise_floor(clean)[:4000]) > 1.0
    noisy = say("put it here", snr_db=20).samples
    assert np.array_equal(add_noise_floor(noisy), noisy)


def test_message_formats_are_read_and_unknown_ones_named():
    frames = np.array([[16384, -16384], [32767, 32767]], dtype="<i2")
    assert decode_samples(frames.tobytes(), "S16LE", 2) == pytest.approx([0.0, 1.0], abs=1e-4)
    assert decode_samples(b"\x00\x00\x00\x3f", "F32LE", 1) == pytest.approx([0.5])
    with pytest.raises(SoundFormatError, match="'MP3' is not one of S16LE"):
        decode_samples(b"", "MP3", 1)
    with pytest.raises(SoundFormatError, match="0 channels"):
        decode_samples(b"", "S16LE", 0)


def test_bad_settings_are_refused():
    with pytest.raises(InvalidConfigError, match="hang_over_s"):
        EndpointerOptions(hang_over_s=0.0)
