# SPDX-License-Identifier: Apache-2.0
"""The default recogniser on simulated speech of voices that nothing was tuned on, and on files."""

from __future__ import annotations

import importlib.util
from itertools import pairwise

import av
import numpy as np
import pytest
import soundfile
from rapidfuzz.distance import Levenshtein
from simulated_speech import say
from uncom_common.exceptions import NotInstalledError
from uncom_language.exceptions import SoundFileError, SoundFormatError, UnknownBackendError
from uncom_language.parser import parse_transcript
from uncom_language.speech import make_recognizer, transcribe_file, transcript_to_json
from uncom_language.types import Act

RATE = 16000
SENTENCES = (
    "take the lemon and put it in this bowl",
    "take this mug and put it here",
    "pick up the red cup",
    "put the banana to the left of the box",
    "take this plate and stack it on top of the other plate",
    "pour the cereal into the bowl",
)
VOICES = (("en-us", 150, 50), ("en-us+m7", 140, 45), ("en-us+f2", 155, 55))


@pytest.fixture(scope="module")
def recognizer():
    return make_recognizer()


def test_tabletop_commands_are_heard_with_few_word_errors_and_true_times(recognizer):
    wrong = words = 0
    late = []
    for voice, speed, pitch in VOICES:
        for number, sentence in enumerate(SENTENCES):
            spoken = say(sentence, voice, speed, pitch, snr_db=25, seed=number)
            heard = recognizer.transcribe(spoken.samples, RATE)
            wrong += Levenshtein.distance(sentence.split(), heard.text.split())
            words += len(sentence.split())
            if heard.text == sentence and len(spoken.starts) == len(heard.words):
                late += [word.start_s - start for word, start in zip(heard.words, spoken.starts, strict=True)]
    assert wrong / words <= 0.08
    assert np.median(np.abs(late)) <= 0.06


@pytest.mark.parametrize(
    "text", ["hello there", "turn on the kitchen light", "what time is it", "i would like a coffee with some milk"]
)
def test_general_talk_becomes_no_command(recognizer, tmp_path, text):
    path = tmp_path / "talk.wav"
    soundfile.write(path, say(text, snr_db=25).samples, RATE)
    transcript = transcribe_file(path)
    assert transcript.words
    assert all(command.act is not Act.COMMAND for command in parse_transcript(transcript))


def test_alternatives_are_other_words_with_lower_scores(recognizer):
    heard = recognizer.transcribe(say("take the lemon and put it in this bowl").samples, RATE)
    assert heard.alternatives
    scores = [other.score for other in heard.alternatives]
    assert scores == sorted(scores, reverse=True)
    assert max(scores) <= 0.0
    assert all(other.text != heard.text for other in heard.alternatives)
    assert all(0.0 <= word.confidence <= 1.0 for word in heard.words)


def test_word_times_are_in_order_and_within_the_sound(recognizer):
    sound = say("put the banana to the left of the box").samples
    words = recognizer.transcribe(sound, RATE).words
    assert all(a.end_s <= b.start_s + 0.02 for a, b in pairwise(words))
    assert words[0].start_s >= 0.0
    assert words[-1].end_s <= len(sound) / RATE + 0.02


def test_silence_gives_no_words_and_a_reason(recognizer):
    for sound in (np.zeros(RATE, np.int16), np.zeros(10, np.int16)):
        heard = recognizer.transcribe(sound, RATE)
        assert not heard.words
        assert heard.reason


def test_samples_of_a_wrong_kind_are_refused(recognizer):
    with pytest.raises(SoundFormatError, match="int16 or float32"):
        recognizer.transcribe(np.zeros(100, np.int64), RATE)


@pytest.mark.parametrize("suffix", ["wav", "flac", "mp3"])
def test_files_of_any_kind_are_read(tmp_path, suffix):
    path = tmp_path / f"speech.{suffix}"
    spoken = say("pick up the red cup", snr_db=30)
    # Not as integers: libsndfile writes noise when those are stereo and the file is MP3.
    soundfile.write(path, np.repeat(spoken.samples[:, None], 2, axis=1) / 32768.0, RATE)
    made = transcript_to_json(transcribe_file(path))
    assert made["text"] == "pick up the red cup"
    assert made["words"][0]["start"] == pytest.approx(spoken.starts[0], abs=0.15)
    assert "pocketsphinx" in made["backend"]


def test_the_sound_track_of_a_film_is_read(recognizer, tmp_path):
    path = tmp_path / "film.mp4"
    samples = say("pick up the red cup", snr_db=30).samples.astype(np.float32) / 32768.0
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=RATE, layout="mono")
        for start in range(0, samples.size, 1024):
            frame = av.AudioFrame.from_ndarray(samples[None, start : start + 1024], format="fltp", layout="mono")
            frame.sample_rate, frame.pts = RATE, start
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    assert transcribe_file(path).text == "pick up the red cup"


def test_bad_files_are_one_line_errors(tmp_path):
    empty, text, hollow = tmp_path / "empty.wav", tmp_path / "text.wav", tmp_path / "hollow.wav"
    empty.touch()
    text.write_text("no sound at all")
    soundfile.write(hollow, np.zeros(0), RATE)
    for path, why in (
        (tmp_path / "none.wav", "no such file"),
        (empty, "empty"),
        (text, "format"),
        (hollow, "no sound"),
        (tmp_path, "folder"),
    ):
        with pytest.raises(SoundFileError, match=why) as caught:
            transcribe_file(path)
        assert "\n" not in str(caught.value)


def test_a_silent_file_has_no_words(tmp_path):
    path = tmp_path / "silence.wav"
    soundfile.write(path, np.zeros(RATE), RATE)
    assert transcript_to_json(transcribe_file(path))["words"] == []


def test_a_back_end_that_does_not_exist_or_is_not_installed_is_named():
    with pytest.raises(UnknownBackendError, match=r"'wisper' is not available .*pocketsphinx, whisper"):
        make_recognizer("wisper")
    if importlib.util.find_spec("torch") is None or importlib.util.find_spec("transformers") is None:
        with pytest.raises(NotInstalledError, match=r"not installed: run ./uncom setup --full"):
            make_recognizer("whisper")


def noises():
    rng = np.random.default_rng(4)
    time = np.arange(3 * RATE) / RATE
    spectrum = np.fft.rfft(rng.normal(size=time.size)) / np.sqrt(np.maximum(np.arange(time.size // 2 + 1), 1))
    pink = np.fft.irfft(spectrum, time.size)
    clicks = np.zeros(time.size)
    clicks[rng.integers(0, time.size, 20)] = 1.0
    ringing = np.exp(-np.arange(300) / 40) * np.cos(np.arange(300) * 0.7)
    melody = np.concatenate(
        [
            sum(
                np.sin(2 * np.pi * 220 * 2 ** (step / 12) * k * time[:6400]) / k * np.exp(-3 * k * time[:6400])
                for k in range(1, 7)
            )
            for step in (0, 4, 7, 12, 7, 4, 0)
        ]
    )
    return {
        "white": rng.normal(size=time.size),
        "pink": pink / pink.std(),
        "hum": np.sin(2 * np.pi * 50 * time) + 0.5 * np.sin(2 * np.pi * 150 * time),
        "tone": np.sin(2 * np.pi * 440 * time),
        "clicks": np.convolve(clicks, ringing)[: time.size],
        "melody": melody,
    }


@pytest.mark.parametrize("kind", noises())
def test_noise_and_music_after_silence_give_no_words(recognizer, tmp_path, kind):
    sound = 0.15 * noises()[kind] / np.abs(noises()[kind]).max()
    hush = np.random.default_rng(5).normal(0, 1e-4, 2 * RATE)
    path = tmp_path / "noise.wav"
    soundfile.write(path, np.concatenate([hush, sound, hush]), RATE)
    assert transcribe_file(path).text == ""
