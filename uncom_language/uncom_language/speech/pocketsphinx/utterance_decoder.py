# SPDX-License-Identifier: Apache-2.0
"""PocketSphinx decoders at work on one utterance, whole or piece by piece."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from uncom_language.speech.audio.samples import INT16_SCALE, SAMPLE_RATE, Int16Array
from uncom_language.speech.pocketsphinx.n_best import Hypothesis, add_confidences, make_alternatives
from uncom_language.speech.pocketsphinx.noise_floor import add_noise_floor, missing_noise_power
from uncom_language.speech.pocketsphinx.options import DECODING, SEARCH, DecodingOptions, SearchOptions
from uncom_language.speech.recognition.recognizer import Recognition, UtteranceDecoder
from uncom_language.speech.recognition.utterance_verification import rejection_reason
from uncom_language.types import Word

_FRAME_S = 0.01
# Scores of PocketSphinx are 1/1024 of log likelihoods; its own posteriors divide those by 20 (-ascale).
_SCORE_TO_LOG = 1024.0 / 20.0


class PocketSphinxUtteranceDecoder(UtteranceDecoder):
    """Decodes while the sound arrives, so that at the end of the speech only the last moment is left to do.

    The first options.mean_s are kept back until their cepstral mean is known. Soon only the likelier model goes on.
    """

    def __init__(
        self, decoders: Sequence[Any], search: SearchOptions = SEARCH, options: DecodingOptions = DECODING
    ) -> None:
        """Begin an utterance.

        Args:
            decoders: one for each acoustic model; they must not be used otherwise until `finish`.
            search: how many alternatives are returned.
            options: how sound is handed to the decoders.
        """
        self._decoders = list(decoders)
        self._search, self._options = search, options
        self._pending: list[Int16Array] = []
        self._pending_samples = 0
        self._decoded: list[Int16Array] = []
        self._running = False
        self._noise = np.random.default_rng(0)
        self._noise_level = 0.0

    def feed(self, samples: Int16Array) -> None:
        """Take the next samples."""
        self._pending.append(samples)
        self._pending_samples += samples.size
        if self._pending_samples >= (self._options.piece_s if self._running else self._options.mean_s) * SAMPLE_RATE:
            self._decode()

    def partial_text(self) -> str:
        """Return the words of the best path of all decoders."""
        if not self._running:
            return ""
        self._decode()
        score, best = max(self._scored(), key=lambda pair: pair[0])
        if score == -math.inf:
            return ""
        return " ".join(base_word(word) for word in best.hyp().hypstr.split() if is_word(word))

    def finish(self) -> Recognition:
        """End the utterance."""
        if not self._running and (reason := _why_empty(_concatenated(self._pending), self._options)):
            return Recognition(reason=reason)
        self._decode()
        for decoder in self._decoders:
            decoder.end_utt()
        self._running = False
        sound = np.concatenate(self._decoded)
        reason = _why_empty(sound, self._options)
        return (
            Recognition(reason=reason)
            if reason
            else _best_recognition(self._decoders, sound, self._search, self._options)
        )

    def _take_pending(self) -> Int16Array:
        taken = _concatenated(self._pending)
        self._pending.clear()
        self._pending_samples = 0
        return taken

    def _decode(self) -> None:
        if not self._pending_samples:
            return
        sound = self._take_pending()
        if not self._running:
            self._start(sound)
        noise = self._noise.standard_normal(sound.size) * self._noise_level
        heard = np.asarray(np.clip(np.rint(sound + noise), -32768, 32767), dtype=np.int16)
        self._decoded.append(heard)
        for decoder in self._decoders:
            decoder.process_raw(heard.tobytes(), no_search=False, full_utt=False)
        if len(self._decoders) > 1:
            scored = self._scored()
            least = max(score for score, _ in scored) - self._options.hopeless_log
            for score, decoder in scored:
                if -math.inf < score < least:
                    decoder.end_utt()
                    self._decoders.remove(decoder)

    def _scored(self) -> list[tuple[float, Any]]:
        return [(_score(decoder), decoder) for decoder in self._decoders]

    def _start(self, sound: Int16Array) -> None:
        """Take level and cepstral mean from the beginning."""
        self._noise_level = math.sqrt(missing_noise_power(sound))
        for decoder in self._decoders:
            _reset(decoder, self._options)
            decoder.start_utt()
            decoder.process_raw(add_noise_floor(sound).tobytes(), no_search=True, full_utt=True)
            decoder.end_utt()
            decoder.set_cmn(decoder.get_cmn(True))
            decoder.start_utt()
        self._running = True


def _concatenated(pieces: Sequence[Int16Array]) -> Int16Array:
    return np.concatenate([np.zeros(0, np.int16), *pieces])


def _reset(decoder: Any, options: DecodingOptions) -> None:
    """Make a decoder independent of the utterances before this one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # needed all the same: scores drift without it
        decoder.start_stream()
    decoder.set_cmn(",".join(map(str, options.cepstral_mean)))


def _why_empty(sound: Int16Array, options: DecodingOptions) -> str:
    """Return why sound can hold no word; empty if it may hold some."""
    if sound.size < round(options.min_sound_s * SAMPLE_RATE):
        return "too short for a word"
    level = 10.0 * math.log10(float((sound.astype("float64") ** 2).mean()) / INT16_SCALE**2 + 1e-12)
    return "silence" if level < options.min_level_db else ""


def _best_recognition(
    decoders: Sequence[Any], sound: Int16Array, search: SearchOptions, options: DecodingOptions
) -> Recognition:
    """Return the result of the likeliest decoder: that of people's voices or that of synthesised ones."""
    scored = [_ScoredDecoder(decoder, _score(decoder)) for decoder in decoders]
    best = max(scored, key=lambda scored: scored.score)
    if best.score == -math.inf:
        return Recognition(reason="no words in it")
    words = tuple(
        Word(base_word(part.word), part.start_frame * _FRAME_S, (part.end_frame + 1) * _FRAME_S)
        for part in best.decoder.seg()
        if is_word(part.word)
    )
    if not words:
        return Recognition(reason="no words in it")
    hypotheses = _hypotheses(best.decoder, search.hypotheses_per_alternative * search.alternatives)
    words = add_confidences(_trim_onset(words, sound, options), hypotheses)
    reason = rejection_reason(sound, words)
    if reason:
        return Recognition(reason=reason)
    return Recognition(words, make_alternatives(words, hypotheses)[: search.alternatives])


@dataclass(frozen=True, slots=True)
class _ScoredDecoder:
    decoder: Any
    score: float


def _score(decoder: Any) -> float:
    """Return the log score of the best path, minus infinity if there is none."""
    best = decoder.hyp()
    if best is None or not best.hypstr or best.best_score <= 0.0:
        return -math.inf
    return math.log(best.best_score) * _SCORE_TO_LOG


def _trim_onset(words: tuple[Word, ...], sound: Int16Array, options: DecodingOptions) -> tuple[Word, ...]:
    """Let the first word begin where sound rises from the background; the search gives it silence before it."""
    frame = round(_FRAME_S * SAMPLE_RATE)
    usable = sound[: sound.size - sound.size % frame].astype(np.float64).reshape(-1, frame)
    level = 10.0 * np.log10(np.mean(usable**2, axis=1) + 1.0)
    first = words[0]
    begin, end = (round(time / _FRAME_S) for time in (first.start_s, first.end_s))
    background = np.percentile(level, options.onset_background_percentile)
    loud = np.flatnonzero(level[begin:end] > background + options.onset_rise_db)
    if loud.size == 0 or int(loud[0]) <= options.onset_lead_frames:
        return words
    onset = begin + int(loud[0]) - options.onset_lead_frames
    return (replace(first, start_s=onset * _FRAME_S), *words[1:])


def _hypotheses(decoder: Any, limit: int) -> tuple[Hypothesis, ...]:
    """Return the distinct n-best hypotheses, best first, with log scores."""
    found: dict[tuple[str, ...], float] = {}
    for number, hypothesis in enumerate(decoder.nbest()):
        if number >= limit:
            break
        if hypothesis is not None and hypothesis.hypstr and hypothesis.score > 0.0:
            words = tuple(base_word(word) for word in hypothesis.hypstr.split() if is_word(word))
            score = math.log(hypothesis.score) * _SCORE_TO_LOG
            found[words] = max(score, found.get(words, -math.inf))
    return tuple(sorted((Hypothesis(words, score) for words, score in found.items()), key=lambda h: -h.score))


def base_word(word: str) -> str:
    """Return a word without the number of its pronunciation."""
    return word.partition("(")[0]


def is_word(word: str) -> bool:
    """Whether a segment is a word, not silence or noise."""
    return not word.startswith(("<", "[", "+"))
