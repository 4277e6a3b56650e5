# SPDX-License-Identifier: Apache-2.0
"""Adapts PocketSphinx's acoustic model to synthesised speech (maximum a posteriori; Gauvain and Lee 1994).

The model was trained on people; eSpeak NG's voices sound different. This speaks sentences drawn from the language
model's patterns with about eighty speakers in eight accents (none of those used to measure), aligns them, and moves
means, variances and mixture weights towards what was heard. The first round aligns with the model of people, the
others with what the round before made. The result is synthetic_voices.npz of the recogniser. Run from the workspace:

    ./uncom exec python sim/tools/adapt_to_voices.py --sentences 1000 4000
"""

from __future__ import annotations

import argparse
import pickle
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from uncom_language.speech.pocketsphinx.acoustic_model import (
    WEIGHT_STEP,
    Adaptation,
    make_adapted_model,
    read_gaussians,
    read_weights,
    write_adaptation,
)
from uncom_language.speech.pocketsphinx.options import DECODING
from uncom_language.speech.pocketsphinx.pocketsphinx_recognizer import SYNTHETIC_VOICES
from voice_corpus import MODEL, Aligned, aligned_speech, phone_names

FloatArray = npt.NDArray[np.float64]
SILENCE_PHONES = ("SIL", "+NSN+", "+SPN+")
FRAME_S = 0.01  # of PocketSphinx
# The recogniser takes the cepstral mean of the beginning; of short sound that of the whole.
MEAN_FRAMES = round(DECODING.mean_s / FRAME_S)
SHARE_WITH_MEAN_OF_BEGINNING = 0.7  # of the utterances
MIN_VARIANCE = 1e-4


@dataclass(frozen=True)
class Priors:
    """How many frames the original model is worth, for every Gaussian and for every tied state."""

    means: float
    variances: float
    weights: float


@dataclass(frozen=True)
class Model:
    """Means and variances (codebook, stream, density, dimension), weights (stream, density, state)."""

    means: FloatArray
    variances: FloatArray
    weights: FloatArray


@dataclass(frozen=True)
class Frames:
    """All frames: features (stream, frame, 13), and tied state and codebook of each."""

    features: npt.NDArray[np.float32]
    states: npt.NDArray[np.int64]
    codebooks: npt.NDArray[np.int64]


def original_model() -> Model:
    """Return the model of people."""
    weights = np.exp(-WEIGHT_STEP * read_weights(MODEL / "sendump").values.astype(float))
    variances = np.maximum(read_gaussians(MODEL / "variances").values.astype(float), MIN_VARIANCE)
    return Model(read_gaussians(MODEL / "means").values.astype(float), variances, weights)


def features(cepstra: FloatArray, *, of_beginning: bool) -> FloatArray:
    """Return the streams (3, frames, 13) that the model sees: cepstra less their mean, first and second differences."""
    counted = cepstra[:MEAN_FRAMES] if of_beginning else cepstra
    centred = cepstra - counted[counted[:, 0] >= 0].mean(axis=0)
    padded = np.concatenate([np.repeat(centred[:1], 3, axis=0), centred, np.repeat(centred[-1:], 3, axis=0)])
    at = np.arange(len(centred)) + 3
    first = padded[at + 2] - padded[at - 2]
    second = (padded[at + 3] - padded[at - 1]) - (padded[at + 1] - padded[at - 3])
    return np.stack([centred, first, second])


def frames_of(speech: Sequence[Aligned]) -> Frames:
    """Put the frames of all utterances together."""
    rng = np.random.default_rng(0)
    made = []
    for utterance in speech:
        seen = features(utterance.cepstra.astype(float), of_beginning=bool(rng.random() < SHARE_WITH_MEAN_OF_BEGINNING))
        made.append(seen[:, utterance.states >= 0].astype(np.float32))
    known = [utterance.states >= 0 for utterance in speech]
    return Frames(
        np.concatenate(made, axis=1),
        np.concatenate([utterance.states[keep] for utterance, keep in zip(speech, known, strict=True)]).astype(int),
        np.concatenate([utterance.codebooks[keep] for utterance, keep in zip(speech, known, strict=True)]).astype(int),
    )


def responsibilities(x: FloatArray, model: Model, place: tuple[int, int], states: npt.NDArray[np.int64]) -> FloatArray:
    """Return the responsibilities (N, densities) of the densities of a codebook and stream for each frame."""
    means, variances = model.means[place], model.variances[place]
    distance = x**2 @ (1.0 / variances).T - 2.0 * x @ (means / variances).T + (means**2 / variances).sum(axis=1)
    log = -0.5 * (distance + np.log(variances).sum(axis=1)) + np.log(model.weights[place[1]][:, states].T + 1e-12)
    responsibility = np.exp(log - log.max(axis=1, keepdims=True))
    return np.asarray(responsibility / responsibility.sum(axis=1, keepdims=True))


def em_step(model: Model, original: Model, frames: Frames, priors: Priors) -> Model:
    """Return the model after one step of expectation maximisation, drawn to the original by the priors."""
    means, variances = model.means.copy(), model.variances.copy()
    counts = np.zeros_like(model.weights)
    silent = [phone_names().index(name) for name in SILENCE_PHONES]
    for book in np.unique(frames.codebooks):
        at = np.flatnonzero(frames.codebooks == book)
        states = frames.states[at]
        for stream in range(len(frames.features)):
            x = frames.features[stream][at].astype(float)
            responsibility = responsibilities(x, model, (book, stream), states)
            for state in np.unique(states):
                counts[stream][:, state] += responsibility[states == state].sum(axis=0)
            if book in silent:
                continue
            occupied, first, second = responsibility.sum(axis=0)[:, None], responsibility.T @ x, responsibility.T @ x**2
            old, old_variance = original.means[book, stream], original.variances[book, stream]
            mean = (priors.means * old + first) / (priors.means + occupied)
            scatter = second - 2.0 * mean * first + occupied * mean**2 + priors.means * (mean - old) ** 2
            variance = (priors.variances * old_variance + scatter) / (priors.variances + occupied)
            floor = np.minimum(old_variance, 0.1 * old_variance.mean(axis=0) + MIN_VARIANCE)
            means[book, stream], variances[book, stream] = mean, np.maximum(variance, floor)
    total = counts.sum(axis=1, keepdims=True)
    old_weights = original.weights / original.weights.sum(axis=1, keepdims=True)
    weights = (priors.weights * old_weights + counts) / (priors.weights + total)
    return Model(means, variances, np.where(total > 0.0, weights, original.weights))


def adaptation_of(model: Model, original: Model) -> Adaptation:
    """Return what makes a model of the original one."""
    states = np.flatnonzero(np.any(model.weights != original.weights, axis=(0, 1)))
    highest = read_weights(MODEL / "sendump").values.max()
    steps = np.rint(-np.log(np.maximum(model.weights[:, :, states], 1e-30)) / WEIGHT_STEP)
    return Adaptation(
        (model.means - original.means).astype(np.float32),
        np.log(model.variances / original.variances).astype(np.float32),
        states,
        np.clip(steps, 0, highest).astype(np.uint8),
    )


def adapt(speech: Sequence[Aligned], priors: Priors, steps: int) -> Adaptation:
    """Learn from aligned speech."""
    frames, original = frames_of(speech), original_model()
    model = original
    for _ in range(steps):
        model = em_step(model, original, frames, priors)
    return adaptation_of(model, original)


def main(args: list[str] | None = None) -> None:
    """Write the adaptation."""
    parser: Any = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sentences", type=int, nargs="*", default=[1000, 4000], help="sentences of every round")
    parser.add_argument("--steps", type=int, default=3, help="of expectation maximisation in a round")
    parser.add_argument("--mean-frames", type=float, default=5.0, help="frames that an original mean is worth")
    parser.add_argument("--variance-frames", type=float, default=50.0, help="the same for a variance")
    parser.add_argument("--weight-frames", type=float, default=50.0, help="the same for a tied state's weights")
    parser.add_argument("--keep", type=Path, help="file for the aligned speech of the last round")
    parser.add_argument("--kept", type=Path, nargs="*", default=[], help="such files, instead of speaking")
    parser.add_argument("--out", type=Path, default=SYNTHETIC_VOICES)
    options = parser.parse_args(args)
    priors = Priors(options.mean_frames, options.variance_frames, options.weight_frames)
    found: Adaptation | None = None
    speech: list[Aligned] = [utterance for file in options.kept for utterance in pickle.loads(file.read_bytes())]  # noqa: S301 - our own files
    for number, count in enumerate([] if speech else options.sentences):
        with tempfile.TemporaryDirectory() as folder:
            model = MODEL if found is None else make_adapted_model(MODEL, found, Path(folder))
            speech = list(aligned_speech(count, number + 1, model))
        found = adapt(speech, priors, options.steps)
        sys.stderr.write(f"round {number + 1}: {len(speech)} of {count} sentences aligned\n")
    if options.keep:
        options.keep.write_bytes(pickle.dumps(speech))
    write_adaptation(found or adapt(speech, priors, options.steps), options.out)


if __name__ == "__main__":
    main()
