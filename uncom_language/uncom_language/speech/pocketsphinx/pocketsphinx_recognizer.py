# SPDX-License-Identifier: Apache-2.0
"""PocketSphinx with a tabletop language model: the default recogniser, which needs no download."""

from __future__ import annotations

import logging
import os
import tempfile
import threading
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pocketsphinx

from uncom_language.exceptions import RecognizerError
from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array, as_float, resample, to_int16
from uncom_language.speech.pocketsphinx.acoustic_model import LOG_BASE, make_adapted_model, read_adaptation
from uncom_language.speech.pocketsphinx.language_model import draw_sentences, make_arpa
from uncom_language.speech.pocketsphinx.options import (
    DECODING,
    LANGUAGE_MODEL,
    SEARCH,
    DecodingOptions,
    LanguageModelOptions,
    SearchOptions,
)
from uncom_language.speech.pocketsphinx.pronunciation import pronounce, with_accents
from uncom_language.speech.pocketsphinx.utterance_decoder import PocketSphinxUtteranceDecoder
from uncom_language.speech.recognition.recognizer import Recognition, Recognizer, Samples, UtteranceDecoder
from uncom_language.speech.recognition.timestamps import shift_words

_LOG = logging.getLogger(__name__)
# Made by sim/tools/adapt_to_voices.py: how the model changes for synthesised voices.
SYNTHETIC_VOICES = Path(__file__).parent / "models" / "synthetic_voices.npz"

# PocketSphinx's names of the beams, and ours in SearchOptions.
_BEAM_FIELDS = {
    "beam": "beam",
    "pbeam": "phone_beam",
    "wbeam": "word_beam",
    "lpbeam": "last_phone_beam",
    "lponlybeam": "only_phone_beam",
}


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
def _phones() -> frozenset[str]:
    """Return the phones that pronunciations are made of."""
    return frozenset(phone for variants in _dictionary().values() for phones in variants for phone in phones.split())


@cache
def common_words(count: int) -> dict[str, float]:
    """Return the most frequent English words of the wheel's general language model, with their probabilities."""
    logmath = pocketsphinx.LogMath(LOG_BASE)
    model = pocketsphinx.NGramModel(pocketsphinx.Config(), logmath, str(model_folder() / "en-us.lm.bin"))
    frequency = {word: float(logmath.exp(model.prob([word]))) for word in _dictionary() if word.isalpha()}
    top = sorted(frequency, key=lambda word: (-frequency[word], word))[:count]
    return {word: frequency[word] for word in top}


def dictionary_lines(vocabulary: Iterable[str], accented: Collection[str]) -> Iterator[str]:
    """Return the lines of a dictionary; words of `accented` with the pronunciations of several accents."""
    known = _dictionary()
    for word in sorted(vocabulary):
        variants = known.get(word) or (pronounce(word),)
        if word in accented:
            variants = with_accents(word, variants)
        for number, phones in enumerate(variants):
            yield f"{word}({number + 1}) {phones}\n" if number else f"{word} {phones}\n"


class PocketSphinxRecognizer(Recognizer):
    """PocketSphinx 5 with a language model counted from our own sentence patterns.

    Two acoustic models listen: the wheel's en-us for people, and a variant of it for synthesised voices.
    """

    def __init__(
        self,
        scene_words: Sequence[str] = (),
        *,
        language_model: LanguageModelOptions = LANGUAGE_MODEL,
        search: SearchOptions = SEARCH,
        decoding: DecodingOptions = DECODING,
    ) -> None:
        """Build the language model and load the decoder (about 3 s).

        Args:
            scene_words: further words that may be said now, such as names of objects on the table.
            language_model: shares of the language model's levels.
            search: weights and beams of the search.
            decoding: how sound is handed to the decoders.

        Raises:
            RecognizerError: PocketSphinx cannot load its models.
        """
        self._language_model, self._search, self._decoding = language_model, search, decoding
        self._lock = threading.Lock()
        self._sentences = draw_sentences(self._language_model)
        self._general = common_words(self._search.general_words)
        self._decoders = self._load(scene_words)

    @property
    def backend(self) -> str:
        """Name, version and weights."""
        return f"pocketsphinx {version('pocketsphinx')} (en-us, tabletop lm)"

    @property
    def language(self) -> str:
        """English."""
        return "en"

    def _load(self, scene_words: Sequence[str]) -> tuple[Any, ...]:
        vocabulary = {word for sentence in self._sentences for word in sentence} | set(self._general) | set(scene_words)
        arpa = make_arpa(self._sentences, self._general, self._language_model, scene_words)
        with tempfile.TemporaryDirectory(prefix="uncom_lm_") as folder:
            model, dictionary = Path(folder, "lm.arpa"), Path(folder, "words.dict")
            model.write_text(arpa, encoding="utf-8")
            accented = {word for sentence in self._sentences for word in sentence}
            dictionary.write_text("".join(dictionary_lines(vocabulary, accented)), encoding="utf-8")
            plain = model_folder() / "en-us"
            adapted = make_adapted_model(plain, read_adaptation(SYNTHETIC_VOICES), Path(folder))
            wide = {name: getattr(self._search, field) for name, field in _BEAM_FIELDS.items()}
            decoders = (
                self._make_decoder(plain, model, dictionary),
                self._make_decoder(adapted, model, dictionary, **wide),
            )
        # The first utterance of a decoder is scored a little differently from the same sound later: let it be this one.
        options = self._decoding
        size = round(options.warm_up_s * SAMPLE_RATE)
        noise = np.random.default_rng(0).normal(0.0, options.warm_up_level, size).astype(np.int16)
        self._decode(noise, decoders, options.warm_up_block_s)
        return decoders

    def _make_decoder(self, acoustic: Path, model: Path, dictionary: Path, **beams: float) -> Any:
        try:
            return pocketsphinx.Decoder(
                hmm=str(acoustic),
                lm=str(model),
                dict=str(dictionary),
                lw=self._search.language_weight,
                wip=self._search.word_insertion_penalty,
                maxhmmpf=self._search.max_active,
                **beams,
                # A second pass over the utterance at its end: it costs a third of the time and no word less is wrong.
                fwdflat=False,
                # Its tracker starts anew with every utterance and takes the first word for noise.
                remove_noise=False,
                logfn=os.devnull,
                loglevel="FATAL",
            )
        except (RuntimeError, ValueError) as error:
            raise RecognizerError(f"PocketSphinx cannot load its models from {acoustic}: {error}") from error

    def transcribe(self, samples: Samples, sample_rate: int) -> Recognition:
        """Recognise one utterance; longer sound than max_utterance_s is taken in parts."""
        sound = to_int16(resample(as_float(samples), sample_rate))
        piece = round(self._decoding.max_utterance_s * SAMPLE_RATE)
        starts = range(0, max(sound.size, 1), piece)
        with self._lock:
            parts = [
                self._decode(sound[start : start + piece], self._decoders, self._decoding.block_s) for start in starts
            ]
        if len(parts) == 1:
            return parts[0]
        offsets = [start / SAMPLE_RATE for start in starts]
        words = tuple(
            word for part, offset in zip(parts, offsets, strict=True) for word in shift_words(part.words, offset)
        )
        return Recognition(words, reason="" if words else parts[0].reason)

    def _decode(self, sound: Int16Array, decoders: Sequence[Any], block_s: float) -> Recognition:
        """Decode a whole utterance block by block, as it would have come from a microphone."""
        utterance = PocketSphinxUtteranceDecoder(decoders, self._search, self._decoding)
        block = round(block_s * SAMPLE_RATE)
        for start in range(0, sound.size, block):
            utterance.feed(sound[start : start + block])
        return utterance.finish()

    def start_utterance(self) -> UtteranceDecoder:
        """Begin an utterance that is decoded while it arrives; it needs the decoders for itself until it ends."""
        return PocketSphinxUtteranceDecoder(self._decoders, self._search, self._decoding)

    def add_words(self, words: Mapping[str, str]) -> tuple[str, ...]:
        """Learn words at once; those that the dictionary knows keep its pronunciations.

        Raises:
            RecognizerError: a pronunciation is not made of ARPAbet phones; nothing is learnt then.
        """
        known = _dictionary()
        new: dict[str, Sequence[str]] = {}
        with self._lock:
            for text, phones in words.items():
                parts = text.lower().split()
                for word in parts:
                    if not word.replace("'", "").isalpha() or self._decoders[0].lookup_word(word) is not None:
                        continue
                    said = phones.upper() if phones and len(parts) == 1 else ""
                    if set(said.split()) - _phones():
                        raise RecognizerError(f"{phones!r} is no pronunciation (ARPAbet) of {word!r}")
                    new[word] = (said,) if said else known.get(word) or (pronounce(word),)
            if new:
                self._learn(new)
        return tuple(new)

    def _learn(self, words: Mapping[str, Sequence[str]]) -> None:
        entries = [
            (f"{word}({number + 1})" if number else word, phones)
            for word, variants in words.items()
            for number, phones in enumerate(variants)
        ]
        for decoder in self._decoders:
            # Before the decoder knows them: it would give them a weight of its own, which stays.
            model = decoder.get_lm(decoder.current_search())
            for word in words:
                model.add_word(word, self._search.new_word_weight)
            for name, phones in entries[:-1]:
                decoder.add_word(name, phones, False)
            decoder.add_word(*entries[-1], True)  # only now the search is built anew, which takes its time
