# SPDX-License-Identifier: Apache-2.0
"""Speech of many synthesised voices, aligned: what adapt_to_voices.py learns from."""

from __future__ import annotations

import random
import struct
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pocketsphinx
from uncom_language.speech.audio.samples import SAMPLE_RATE
from uncom_language.speech.pocketsphinx.language_model import draw_sentences
from uncom_language.speech.pocketsphinx.noise_floor import add_noise_floor
from uncom_language.speech.pocketsphinx.options import LanguageModelOptions
from uncom_language.speech.pocketsphinx.pocketsphinx_recognizer import dictionary_lines, model_folder
from uncom_sim.person.acoustics import record
from uncom_sim.person.voice import speak

FloatArray = npt.NDArray[np.float64]
Samples = npt.NDArray[np.int16]
MODEL = model_folder() / "en-us"
# Kept for measuring, so never learnt from. Speakers: m3, m7, f2, f4, Andy, Alicia, Denis, Hugo, Lee, anika, belinda,
# david, ed, grandma, iven2, klatt3, john, steph2, zac, travis, and the plain voices; and these three pairs:
HELD_OUT = ("en+m1", "en+f3", "en-gb-x-rp+m1")
SPEAKERS = """
Alex Andrea Annie AnxiousAndy Demonic Diogo Gene Gene2 Henrique Jacky Marco Mario Michael Mike Nguyen Reed
RicishayMax RicishayMax2 RicishayMax3 Storm Tweaky UniRobot adam anikaRobot announcer antonio aunty benjamin boris
caleb croak edward edward2 f1 f3 f5 grandpa gustave ian iven iven3 iven4 kaukovalta klatt klatt2 klatt4 klatt5
klatt6 linda m1 m2 m4 m5 m6 m8 marcelo max michel miguel mike2 norbert pablo paul pedro quincy rob robert robosoft
robosoft2 robosoft3 robosoft4 robosoft5 robosoft6 robosoft7 robosoft8 sandro serious shelby steph steph3 victor
whisper whisperf
""".split()  # noqa: SIM905 - a list of words
ACCENTS = (
    *["en-us"] * 10,
    *["en"] * 5,
    *["en-gb-x-rp"] * 3,
    "en-gb-scotland",
    "en-gb-x-gbclan",
    "en-gb-x-gbcwmd",
    "en-us-nyc",
    "en-029",
)
LEAD_S, TAIL_S = 0.3, 0.5  # silence before and after the words
MIN_WORDS, MAX_WORDS = 4, 15  # of a sentence
CLEAN_SHARE = 0.5  # of the sentences get white noise alone, the others a room
PROGRESS_EVERY = 100  # sentences


@dataclass(frozen=True)
class Aligned:
    """An utterance: cepstra (frames, 13), and tied state and codebook of every frame (-1: unknown)."""

    cepstra: npt.NDArray[np.float32]
    states: npt.NDArray[np.int64]
    codebooks: npt.NDArray[np.int64]


def phone_names() -> list[str]:
    """Return the context-independent phones in the order of the codebooks."""
    data = (MODEL / "mdef").read_bytes()
    (length,) = struct.unpack_from("<i", data, 8)
    (count,) = struct.unpack_from("<i", data, 12 + length)
    return [name.decode() for name in data[12 + length + 40 :].split(b"\0")[:count]]


class Aligner:
    """Aligns known words to sound."""

    def __init__(self, model: Path, words: set[str], folder: Path) -> None:
        """Load a decoder that writes its cepstra into `folder`."""
        self._logs = folder / "cepstra"
        self._logs.mkdir()
        dictionary = folder / "words.dict"
        dictionary.write_text("".join(dictionary_lines(words, words)), encoding="utf-8")
        self._codebook = {name: index for index, name in enumerate(phone_names())}
        self._decoder = pocketsphinx.Decoder(
            hmm=str(model), dict=str(dictionary), loglevel="FATAL", mfclogdir=str(self._logs), remove_noise=False
        )

    def align(self, text: str, samples: Samples) -> Aligned | None:
        """Return the alignment, None if the words do not fit the sound."""
        for file in self._logs.iterdir():
            file.unlink()
        try:
            self._decoder.set_align_text(text)
            self._run(samples)
            if self._decoder.hyp() is None:
                return None
            self._decoder.set_alignment()
            self._run(samples)
        except RuntimeError:
            return None
        data = min(self._logs.iterdir()).read_bytes()
        cepstra = np.frombuffer(data[4:], ">f4").reshape(-1, 13).astype(np.float32)
        states, codebooks = np.full(len(cepstra), -1), np.zeros(len(cepstra), dtype=int)
        for word in self._decoder.get_alignment():
            for phone in word:
                for state in phone:
                    stretch = slice(state.start, state.start + state.duration)
                    states[stretch], codebooks[stretch] = int(state.name), self._codebook[phone.name]
        return Aligned(cepstra, states, codebooks)

    def _run(self, samples: Samples) -> None:
        self._decoder.start_stream()
        self._decoder.start_utt()
        self._decoder.process_raw(samples.tobytes(), full_utt=True)
        self._decoder.end_utt()


def recording(text: str, voice: str, rng: random.Random) -> Samples:
    """Return the sentence as a microphone hears it: some speed, pitch, level, noise and echo."""
    spoken = speak(text, voice, rng.randrange(100, 221), rng.randrange(100))
    noise = np.random.default_rng(rng.randrange(10**6))
    if rng.random() < CLEAN_SHARE:
        pauses = [np.zeros(round(length * SAMPLE_RATE)) for length in (LEAD_S, TAIL_S)]
        wave = np.concatenate([pauses[0], spoken.samples, pauses[1]])
        ratio = 10.0 ** (rng.choice([15, 18, 20, 22, 25, 30, 60]) / 10.0)
        wave = wave + noise.standard_normal(wave.size) * np.sqrt(np.mean(spoken.samples**2) / ratio)
        wave = wave * (32768.0 * rng.choice([0.2, 0.5, 1.0]))
        return add_noise_floor(np.asarray(np.clip(wave, -32768, 32767), dtype=np.int16))
    murmur, echo = rng.choice([0.0, 0.005, 0.02, 0.05, 0.1]), rng.choice([0.0, 0.0, 0.1, 0.3])
    return add_noise_floor(record(spoken, LEAD_S, spoken.duration_s + LEAD_S + TAIL_S, murmur, echo, noise))


def aligned_speech(count: int, seed: int, model: Path) -> Iterator[Aligned]:
    """Speak and align `count` sentences; what cannot be aligned is left out."""
    rng = random.Random(seed)
    drawn = draw_sentences(LanguageModelOptions(seed=500 + seed, sentences=4 * count + 100))
    texts = [words for words in drawn if MIN_WORDS <= len(words) <= MAX_WORDS][:count]
    with tempfile.TemporaryDirectory() as folder:
        aligner = Aligner(model, {word for words in texts for word in words}, Path(folder))
        for number, words in enumerate(texts):
            accent, speaker = rng.choice(ACCENTS), SPEAKERS[(7 * number + seed) % len(SPEAKERS)]
            voice = f"{'en-us' if f'{accent}+{speaker}' in HELD_OUT else accent}+{speaker}"
            found = aligner.align(" ".join(words), recording(" ".join(words), voice, rng))
            if found is not None:
                yield found
            if (number + 1) % PROGRESS_EVERY == 0:
                sys.stderr.write(f"{number + 1} of {len(texts)} sentences\n")
