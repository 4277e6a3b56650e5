# SPDX-License-Identifier: Apache-2.0
"""PocketSphinx decoders at work on one utterance, whole or piece by piece."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array
from uncom_language.speech.pocketsphinx.n_best import Hypothesis, make_alternatives, with_confidences
from uncom_language.speech.pocketsphinx.noise_floor import missing_floor, with_floor
from uncom_language.speech.recognition.recognizer import Hearing, Recognition
from uncom_language.speech.recognition.utterance_verification import why_not_speech
from uncom_language.types import Word

_FRAME_S = 0.01
# Scores of PocketSphinx are 1/1024 of log likelihoods; its own posteriors divide those by 20 (-ascale).
_SCORE_TO_LOG = 1024.0 / 20.0
_MIN_DECIBEL = -70.0
_RISE_DB = 6.0  # a word's first sound stands out of the background by this
# After this much sound the cepstral mean is known well enough to begin (measured: as good as the whole utterance's).
_MEAN_S = 0.8
_PIECE_S = 0.09
# A model that is so much less likely [log score] than another is not heard any more: what lay behind by half of that
# never came to the front (measured on people and on synthesised voices).
_HOPELESS = 12.0
# Cepstral mean from which each utterance starts, the same for all, so that no utterance depends on those before it:
# what PocketSphinx had arrived at after twelve sentences in nine voices. It weighs as much as five seconds of sound.
_MEAN = "62.8,-7.75,-2.02,5.14,-4.49,-4.12,-2.62,-7.64,-5.75,-4.24,-0.83,-0.57,-3.45"


class PocketSphinxHearing(Hearing):
    """Decodes while the sound arrives, so that at the end of the speech only the last moment is left to do.

    The first 0.8 s are kept back until their cepstral mean is known. Soon only the likelier model goes on listening.
    """

    def __init__(self, decoders: Sequence[Any], alternatives: int) -> None:
        """Begin; the decoders must not be used otherwise until `finish`."""
        self._decoders = list(decoders)
        self._alternatives = alternatives
        self._kept: list[Int16Array] = []
        self._waiting = 0
        self._sound: list[Int16Array] = []
        self._running = False
        self._noise = np.random.default_rng(0)
        self._floor = 0.0

    def feed(self, samples: Int16Array) -> None:
        """Take the next samples."""
        self._kept.append(samples)
        self._waiting += samples.size
        if self._waiting >= (_PIECE_S if self._running else _MEAN_S) * SAMPLE_RATE:
            self._decode()

    def words_so_far(self) -> str:
        """Return the words of the best path of all decoders."""
        if not self._running:
            return ""
        self._decode()
        score, best = max(self._scored(), key=lambda pair: pair[0])
        if score == -math.inf:
            return ""
        return " ".join(plain(word) for word in best.hyp().hypstr.split() if is_word(word))

    def finish(self) -> Recognition:
        """End the utterance."""
        if not self._running and (reason := _too_little(_joined(self._kept))):
            return Recognition(reason=reason)
        self._decode()
        for decoder in self._decoders:
            decoder.end_utt()
        self._running = False
        sound = np.concatenate(self._sound)
        reason = _too_little(sound)
        return Recognition(reason=reason) if reason else _best(self._decoders, sound, self._alternatives)

    def _take(self) -> Int16Array:
        taken = _joined(self._kept)
        self._kept.clear()
        self._waiting = 0
        return taken

    def _decode(self) -> None:
        if not self._waiting:
            return
        sound = self._take()
        if not self._running:
            self._begin(sound)
        noise = self._noise.standard_normal(sound.size) * self._floor
        heard = np.asarray(np.clip(np.rint(sound + noise), -32768, 32767), dtype=np.int16)
        self._sound.append(heard)
        for decoder in self._decoders:
            decoder.process_raw(heard.tobytes(), no_search=False, full_utt=False)
        if len(self._decoders) > 1:
            scored = self._scored()
            least = max(score for score, _ in scored) - _HOPELESS
            for score, decoder in scored:
                if -math.inf < score < least:
                    decoder.end_utt()
                    self._decoders.remove(decoder)

    def _scored(self) -> list[tuple[float, Any]]:
        return [(_score(decoder), decoder) for decoder in self._decoders]

    def _begin(self, sound: Int16Array) -> None:
        """Take level and cepstral mean from the beginning."""
        self._floor = math.sqrt(missing_floor(sound))
        for decoder in self._decoders:
            _forget(decoder)
            decoder.start_utt()
            decoder.process_raw(with_floor(sound).tobytes(), no_search=True, full_utt=True)
            decoder.end_utt()
            decoder.set_cmn(decoder.get_cmn(True))
            decoder.start_utt()
        self._running = True


def _joined(pieces: Sequence[Int16Array]) -> Int16Array:
    return np.concatenate([np.zeros(0, np.int16), *pieces])


def _forget(decoder: Any) -> None:
    """Let nothing of the utterances before this one count."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # needed all the same: scores drift without it
        decoder.start_stream()
    decoder.set_cmn(_MEAN)


def _too_little(sound: Int16Array) -> str:
    if sound.size < SAMPLE_RATE // 10:
        return "too short for a word"
    level = 10.0 * math.log10(float((sound.astype("float64") ** 2).mean()) / 32768.0**2 + 1e-12)
    return "silence" if level < _MIN_DECIBEL else ""


def _best(decoders: Sequence[Any], sound: Int16Array, alternatives: int) -> Recognition:
    """Return what the likeliest decoder heard: the model of people's voices or that of synthesised ones."""
    scored = [_Scored(decoder, _score(decoder)) for decoder in decoders]
    best = max(scored, key=lambda one: one.score)
    if best.score == -math.inf:
        return Recognition(reason="no words in it")
    words = tuple(
        Word(plain(part.word), part.start_frame * _FRAME_S, (part.end_frame + 1) * _FRAME_S)
        for part in best.decoder.seg()
        if is_word(part.word)
    )
    if not words:
        return Recognition(reason="no words in it")
    hypotheses = _hypotheses(best.decoder, 10 * alternatives)
    words = with_confidences(_onset_trimmed(words, sound), hypotheses)
    reason = why_not_speech(sound, words)
    if reason:
        return Recognition(reason=reason)
    return Recognition(words, make_alternatives(words, hypotheses)[:alternatives])


@dataclass(frozen=True, slots=True)
class _Scored:
    decoder: Any
    score: float


def _score(decoder: Any) -> float:
    """Return the log score of the best path, minus infinity if there is none."""
    best = decoder.hyp()
    if best is None or not best.hypstr or best.best_score <= 0.0:
        return -math.inf
    return math.log(best.best_score) * _SCORE_TO_LOG


def _onset_trimmed(words: tuple[Word, ...], sound: npt.NDArray[np.int16]) -> tuple[Word, ...]:
    """Let the first word begin where sound rises from the background; the search gives it silence before it."""
    frame = round(_FRAME_S * SAMPLE_RATE)
    usable = sound[: sound.size - sound.size % frame].astype(np.float64).reshape(-1, frame)
    level = 10.0 * np.log10(np.mean(usable**2, axis=1) + 1.0)
    first = words[0]
    begin, end = (round(time / _FRAME_S) for time in (first.start_s, first.end_s))
    loud = np.flatnonzero(level[begin:end] > np.percentile(level, 10) + _RISE_DB)
    if loud.size == 0 or int(loud[0]) <= 3:
        return words
    return (replace(first, start_s=(begin + int(loud[0]) - 3) * _FRAME_S), *words[1:])


def _hypotheses(decoder: Any, limit: int) -> tuple[Hypothesis, ...]:
    """Return the distinct n-best hypotheses, best first, with log scores."""
    found: dict[tuple[str, ...], float] = {}
    for number, hypothesis in enumerate(decoder.nbest()):
        if number >= limit:
            break
        if hypothesis is not None and hypothesis.hypstr and hypothesis.score > 0.0:
            words = tuple(plain(word) for word in hypothesis.hypstr.split() if is_word(word))
            score = math.log(hypothesis.score) * _SCORE_TO_LOG
            found[words] = max(score, found.get(words, -math.inf))
    return tuple(sorted((Hypothesis(words, score) for words, score in found.items()), key=lambda h: -h.score))


def plain(word: str) -> str:
    """Return a word without the number of its pronunciation."""
    return word.partition("(")[0]


def is_word(word: str) -> bool:
    """Whether a segment is a word, not silence or noise."""
    return not word.startswith(("<", "[", "+"))
