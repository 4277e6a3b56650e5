# SPDX-License-Identifier: Apache-2.0
"""PocketSphinx with a tabletop language model: the default recogniser, which needs no download."""

from __future__ import annotations

import logging
import math
import os
import tempfile
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pocketsphinx

from uncom_language.exceptions import RecognizerError
from uncom_language.speech.acoustic_model import make_shifted_model, read_shift
from uncom_language.speech.alternatives import Hypothesis, make_alternatives, with_confidences
from uncom_language.speech.audio import SAMPLE_RATE, Int16Array, as_float, resample, to_int16, with_floor
from uncom_language.speech.language_model import ModelWeights, draw_sentences, make_arpa
from uncom_language.speech.plausibility import why_not_speech
from uncom_language.speech.pronunciation import pronounce, with_accents
from uncom_language.speech.recognizer import Recognition, Recognizer, Samples
from uncom_language.speech.timeline import shifted
from uncom_language.types import Word

_LOG = logging.getLogger(__name__)
_FRAME_S = 0.01
_LONGEST_S = 30.0
# Scores of PocketSphinx are 1/1024 of log likelihoods; its own posteriors divide those by 20 (-ascale).
_SCORE_TO_LOG = 1024.0 / 20.0
_MIN_DECIBEL = -70.0
_RISE_DB = 6.0  # a word's first sound stands out of the background by this
# Made by tools/adapt_to_voices.py: how the means move for synthesised voices.
_SYNTHETIC_VOICES = Path(__file__).parent / "models" / "synthetic_voices.npz"


@dataclass(frozen=True, slots=True)
class DecoderWeights:
    """Numbers of the search; see `pocketsphinx_batch -help`."""

    lw: float = 9.0
    wip: float = 0.65
    general_words: int = 2000
    max_active: int = 3000  # states that stay in the search per frame
    alternatives: int = 8


def model_folder() -> Path:
    """Return where the wheel's English models lie."""
    return Path(pocketsphinx.get_model_path("en-us"))


@cache
def _dictionary() -> dict[str, tuple[str, ...]]:
    """Return the wheel's pronunciations (cmudict), all variants of a word."""
    table: dict[str, list[str]] = {}
    with (model_folder() / "cmudict-en-us.dict").open(encoding="utf-8") as lines:
        for line in lines:
            name, _, phones = line.strip().partition(" ")
            table.setdefault(name.partition("(")[0], []).append(phones)
    return {word: tuple(variants) for word, variants in table.items()}


@cache
def common_words(count: int) -> dict[str, float]:
    """Return the most frequent English words of the wheel's general language model, with their probabilities."""
    logmath = pocketsphinx.LogMath(1.0001)
    model = pocketsphinx.NGramModel(pocketsphinx.Config(), logmath, str(model_folder() / "en-us.lm.bin"))
    frequency = {word: float(logmath.exp(model.prob([word]))) for word in _dictionary() if word.isalpha()}
    top = sorted(frequency, key=lambda word: (-frequency[word], word))[:count]
    return {word: frequency[word] for word in top}


class PocketSphinxRecognizer(Recognizer):
    """PocketSphinx 5 with a language model counted from our own sentence patterns.

    Two acoustic models listen: the wheel's en-us for people, and a variant of it for synthesised voices.
    """

    def __init__(
        self, model: ModelWeights | None = None, decoder: DecoderWeights | None = None, scene_words: Sequence[str] = ()
    ) -> None:
        """Build the language model and load the decoder (about 3 s).

        Args:
            model: shares of the language model's levels.
            decoder: weights of the search.
            scene_words: further words that may be said now, such as names of things on the table.

        Raises:
            RecognizerError: PocketSphinx cannot load its models.
        """
        self._model = model or ModelWeights()
        self._weights = decoder or DecoderWeights()
        self._lock = threading.Lock()
        self._sentences = draw_sentences(self._model)
        self._general = common_words(self._weights.general_words)
        self._decoders = self._load(scene_words)

    @property
    def backend(self) -> str:
        """Name, version and weights."""
        return f"pocketsphinx {version('pocketsphinx')} (en-us, tabletop lm)"

    @property
    def language(self) -> str:
        """English."""
        return "en"

    def set_scene_words(self, words: Iterable[str]) -> None:
        """Make words likely that the scene offers; unknown ones get a pronunciation made by rule."""
        decoders = self._load(sorted({piece for word in words for piece in word.lower().split()}))
        with self._lock:
            self._decoders = decoders

    def _load(self, scene_words: Sequence[str]) -> tuple[Any, ...]:
        vocabulary = {word for sentence in self._sentences for word in sentence} | set(self._general) | set(scene_words)
        arpa = make_arpa(self._sentences, self._general, self._model, scene_words)
        with tempfile.TemporaryDirectory(prefix="uncom_lm_") as folder:
            model, dictionary = Path(folder, "lm.arpa"), Path(folder, "words.dict")
            model.write_text(arpa, encoding="utf-8")
            dictionary.write_text("".join(self._dictionary_lines(vocabulary)), encoding="utf-8")
            plain = model_folder() / "en-us"
            shifted = make_shifted_model(plain, read_shift(_SYNTHETIC_VOICES), Path(folder))
            return tuple(self._make_decoder(acoustic, model, dictionary) for acoustic in (plain, shifted))

    def _make_decoder(self, acoustic: Path, model: Path, dictionary: Path) -> Any:
        try:
            return pocketsphinx.Decoder(
                hmm=str(acoustic),
                lm=str(model),
                dict=str(dictionary),
                lw=self._weights.lw,
                wip=self._weights.wip,
                maxhmmpf=self._weights.max_active,
                # Its tracker starts anew with every utterance and takes the first word for noise.
                remove_noise=False,
                logfn=os.devnull,
                loglevel="FATAL",
            )
        except (RuntimeError, ValueError) as error:
            raise RecognizerError(f"PocketSphinx cannot load its models from {acoustic}: {error}") from error

    def _dictionary_lines(self, vocabulary: Iterable[str]) -> Iterable[str]:
        known = _dictionary()
        accented = {word for sentence in self._sentences for word in sentence}
        for word in sorted(vocabulary):
            variants = known.get(word) or (pronounce(word),)
            if word in accented:
                variants = with_accents(word, variants)
            for number, phones in enumerate(variants):
                yield f"{word}({number + 1}) {phones}\n" if number else f"{word} {phones}\n"

    def transcribe(self, samples: Samples, sample_rate: int) -> Recognition:
        """Recognise one utterance; long sound is taken in pieces of at most 30 s."""
        sound = to_int16(resample(as_float(samples), sample_rate))
        if sound.size < SAMPLE_RATE // 10:
            return Recognition(reason="too short for a word")
        if _level_db(sound) < _MIN_DECIBEL:
            return Recognition(reason="silence")
        sound = with_floor(sound)
        piece = round(_LONGEST_S * SAMPLE_RATE)
        if sound.size <= piece:
            return self._decode(sound)
        starts = range(0, sound.size, piece)
        parts = [self._decode(sound[start : start + piece]) for start in starts]
        offsets = [start / SAMPLE_RATE for start in starts]
        words = tuple(word for part, offset in zip(parts, offsets, strict=True) for word in shifted(part.words, offset))
        return Recognition(words, reason="" if words else parts[0].reason)

    def _decode(self, sound: Int16Array) -> Recognition:
        """Decode with the model of people's voices and with that of synthesised ones; the likelier one counts."""
        with self._lock:
            scored = [_Scored(decoder, _run(decoder, sound)) for decoder in self._decoders]
            best = max(scored, key=lambda one: one.score)
            if best.score == -math.inf:
                return Recognition(reason="no words in it")
            words = tuple(
                Word(
                    _plain(part.word),
                    part.start_frame * _FRAME_S,
                    (part.end_frame + 1) * _FRAME_S,
                )
                for part in best.decoder.seg()
                if _is_word(part.word)
            )
            hypotheses = _hypotheses(best.decoder, 10 * self._weights.alternatives)
        if not words:
            return Recognition(reason="no words in it")
        words = with_confidences(_onset_trimmed(words, sound), hypotheses)
        reason = why_not_speech(sound, words)
        if reason:
            return Recognition(reason=reason)
        return Recognition(words, make_alternatives(words, hypotheses)[: self._weights.alternatives])


@dataclass(frozen=True, slots=True)
class _Scored:
    decoder: Any
    score: float


def _run(decoder: Any, sound: Int16Array) -> float:
    """Decode; return the log score of the best path, minus infinity if there is none."""
    decoder.start_stream()  # forget the noise of earlier utterances: the same sound gives the same words
    decoder.start_utt()
    decoder.process_raw(sound.tobytes(), no_search=False, full_utt=True)
    decoder.end_utt()
    best = decoder.hyp()
    if best is None or not best.hypstr or best.best_score <= 0.0:
        return -math.inf
    return math.log(best.best_score) * _SCORE_TO_LOG


def _onset_trimmed(words: tuple[Word, ...], sound: Int16Array) -> tuple[Word, ...]:
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
        if hypothesis.hypstr and hypothesis.score > 0.0:
            words = tuple(_plain(word) for word in hypothesis.hypstr.split() if _is_word(word))
            score = math.log(hypothesis.score) * _SCORE_TO_LOG
            found[words] = max(score, found.get(words, -math.inf))
    return tuple(sorted((Hypothesis(words, score) for words, score in found.items()), key=lambda h: -h.score))


def _level_db(sound: Int16Array) -> float:
    return 10.0 * math.log10(float((sound.astype("float64") ** 2).mean()) / 32768.0**2 + 1e-12)


def _plain(word: str) -> str:
    """Return a word without the number of its pronunciation."""
    return word.partition("(")[0]


def _is_word(word: str) -> bool:
    return not word.startswith(("<", "[", "+"))
