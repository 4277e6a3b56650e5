# SPDX-License-Identifier: Apache-2.0
"""Adapts PocketSphinx's acoustic model to synthesised speech (maximum a posteriori; Gauvain and Lee 1994).

The model was trained on people; eSpeak NG's formant voices sound different. This speaks sentences drawn from the
language model's patterns with many voices (none of those used to measure), aligns them, and moves the means of the
Gaussians towards what was heard. The result is speech/models/synthetic_voices.npz. Run from the workspace:

    ./uncom exec python uncom_language/tools/adapt_to_voices.py --sentences 12 [--rounds 2]
"""

from __future__ import annotations

import argparse
import random
import struct
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pocketsphinx
from uncom_language.speech.acoustic_model import make_shifted_model, read_gaussians, write_shift
from uncom_language.speech.audio import with_floor
from uncom_language.speech.language_model import ModelWeights, draw_sentences
from uncom_sim.person.sound import recorded
from uncom_sim.person.voice import speak

FloatArray = npt.NDArray[np.float64]
MODEL = Path(pocketsphinx.get_model_path("en-us")) / "en-us"
OUTPUT = Path(__file__).parents[1] / "uncom_language" / "speech" / "models" / "synthetic_voices.npz"
# Kept away from here, for measuring: en-us, en, en-us+m3, m7, f2, f4, Andy, en+m1, f3, en-gb-x-rp+m1.
VOICES = (
    "en-us+m1", "en-us+m2", "en-us+m4", "en-us+m5", "en-us+m6", "en-us+m8", "en-us+f1", "en-us+f3", "en-us+f5",
    "en-us+Annie", "en-us+Michael", "en-us+linda", "en-us+Alex", "en-us+steph", "en+m2", "en+m4", "en+m6", "en+m8",
    "en+f1", "en+f5", "en+Mike", "en-gb-x-rp+f3", "en-gb-x-rp+m2", "en-gb-scotland+m4",
)  # fmt: skip
SILENT = ("SIL", "+NSN+", "+SPN+")


def phone_names() -> list[str]:
    """Return the context-independent phones in the order of the codebooks."""
    data = (MODEL / "mdef").read_bytes()
    (length,) = struct.unpack_from("<i", data, 8)
    (count,) = struct.unpack_from("<i", data, 12 + length)
    return [name.decode() for name in data[12 + length + 40 :].split(b"\0")[:count]]


def log_weights(densities: int, streams: int) -> FloatArray:
    """Return the mixture weights (stream, density, senone) as logarithms."""
    data = (MODEL / "sendump").read_bytes()
    senones = len(data) // (streams * densities)
    raw = np.frombuffer(data[-streams * densities * senones :], np.uint8).reshape(streams, densities, senones)
    return -(raw.astype(float)) * 1024.0 * np.log(1.0001)


def features(cepstra: FloatArray) -> FloatArray:
    """Return the streams (3, frames, 13) that the model sees: cepstra less their mean, first and second differences."""
    centred = cepstra - cepstra[cepstra[:, 0] >= 0].mean(axis=0)
    padded = np.concatenate([np.repeat(centred[:1], 3, axis=0), centred, np.repeat(centred[-1:], 3, axis=0)])
    at = np.arange(len(centred)) + 3
    first = padded[at + 2] - padded[at - 2]
    second = (padded[at + 3] - padded[at - 1]) - (padded[at + 1] - padded[at - 3])
    return np.stack([centred, first, second])


@dataclass(frozen=True)
class Aligned:
    """An utterance: cepstra (frames, 13), and senone and codebook of every frame (-1: unknown)."""

    cepstra: FloatArray
    senones: npt.NDArray[np.int64]
    codebooks: npt.NDArray[np.int64]


class Aligner:
    """Aligns known words to sound."""

    def __init__(self, model: Path, folder: Path) -> None:
        """Load a decoder that writes its cepstra into `folder`."""
        self._folder = folder
        self._codebook = {name: index for index, name in enumerate(phone_names())}
        self._decoder = pocketsphinx.Decoder(hmm=str(model), loglevel="FATAL", mfclogdir=str(folder))

    def align(self, text: str, samples: npt.NDArray[np.int16]) -> Aligned | None:
        """Return the alignment, None if the words do not fit the sound."""
        for file in self._folder.iterdir():
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
        data = min(self._folder.iterdir()).read_bytes()
        cepstra = np.frombuffer(data[4:], ">f4").reshape(-1, 13).astype(float)
        senones, codebooks = np.full(len(cepstra), -1), np.zeros(len(cepstra), dtype=int)
        for word in self._decoder.get_alignment():
            for phone in word:
                for state in phone:
                    stretch = slice(state.start, state.start + state.duration)
                    senones[stretch], codebooks[stretch] = int(state.name), self._codebook[phone.name]
        return Aligned(cepstra, senones, codebooks)

    def _run(self, samples: npt.NDArray[np.int16]) -> None:
        self._decoder.start_stream()
        self._decoder.start_utt()
        self._decoder.process_raw(samples.tobytes(), full_utt=True)
        self._decoder.end_utt()


class Statistics:
    """Occupation and sum of the features of every Gaussian."""

    def __init__(self, means: FloatArray) -> None:
        """Begin empty."""
        self._means = means
        self._variances = np.maximum(read_gaussians(MODEL / "variances").values.astype(float), 1e-4)
        self._weights = log_weights(means.shape[2], means.shape[1])
        self.occupation = np.zeros(means.shape[:3])
        self.sums = np.zeros(means.shape)

    def add(self, aligned: Aligned) -> None:
        """Add one utterance."""
        streams = features(aligned.cepstra)
        for senone in np.unique(aligned.senones[aligned.senones >= 0]):
            at = np.flatnonzero(aligned.senones == senone)
            book = aligned.codebooks[at[0]]
            for stream in range(len(streams)):
                x, variance = streams[stream][at], self._variances[book, stream]
                distance = ((x[:, None] - self._means[book, stream]) ** 2 / variance).sum(axis=2)
                log = self._weights[stream, :, senone] - 0.5 * (distance + np.log(2 * np.pi * variance).sum(axis=1))
                share = np.exp(log - log.max(axis=1, keepdims=True))
                share /= share.sum(axis=1, keepdims=True)
                self.occupation[book, stream] += share.sum(axis=0)
                self.sums[book, stream] += share.T @ x


def recording(text: str, voice: str, rng: random.Random) -> npt.NDArray[np.int16]:
    """Return the sentence as a microphone hears it: some speed, pitch, noise and echo."""
    spoken = speak(text, voice, rng.choice([130, 145, 160, 170]), rng.choice([35, 50, 65]))
    noise, echo = rng.choice([0.0, 0.005, 0.02, 0.05, 0.1]), rng.choice([0.0, 0.0, 0.1, 0.3])
    sound = recorded(spoken, 0.3, spoken.duration_s + 0.7, noise, echo, np.random.default_rng(rng.randrange(10**6)))
    return with_floor(sound)


def adapt(sentences: int, rounds: int, prior_frames: float) -> FloatArray:
    """Return how far every mean moves."""
    original = read_gaussians(MODEL / "means").values.astype(float)
    shift = np.zeros_like(original)
    silent = [phone_names().index(name) for name in SILENT]
    for number in range(rounds):
        rng = random.Random(number)
        texts = [" ".join(words) for words in draw_sentences(ModelWeights(seed=77 + number)) if len(words) > 4]
        with tempfile.TemporaryDirectory() as logs, tempfile.TemporaryDirectory() as folder:
            model = make_shifted_model(MODEL, shift.astype(np.float32), Path(folder))
            aligner, statistics = Aligner(model, Path(logs)), Statistics(original + shift)
            for index, voice in enumerate(VOICES):
                for text in texts[index * sentences : (index + 1) * sentences]:
                    aligned = aligner.align(text, recording(text, voice, rng))
                    if aligned is not None:
                        statistics.add(aligned)
                sys.stderr.write(f"round {number + 1}: {voice}\n")
        occupation = statistics.occupation[..., None]
        shift = (prior_frames * original + statistics.sums) / (prior_frames + occupation) - original
        shift[silent] = 0.0
    return shift


def main(args: list[str] | None = None) -> None:
    """Write the adaptation."""
    parser: Any = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, default=12, help="sentences a voice and round")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--prior-frames", type=float, default=5.0, help="how many frames the original mean is worth")
    options = parser.parse_args(args)
    OUTPUT.parent.mkdir(exist_ok=True)
    write_shift(adapt(options.sentences, options.rounds, options.prior_frames).astype(np.float32), OUTPUT)


if __name__ == "__main__":
    main()
