# SPDX-License-Identifier: Apache-2.0
"""PocketSphinx with a tabletop language model: the default recogniser, which needs no download."""

from __future__ import annotations

import logging
import os
import tempfile
import threading
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pocketsphinx

from uncom_language.exceptions import RecognizerError
from uncom_language.speech.audio.samples import SAMPLE_RATE, Int16Array, as_float, resample, to_int16
from uncom_language.speech.pocketsphinx.acoustic_model import make_adapted_model, read_adaptation
from uncom_language.speech.pocketsphinx.language_model import ModelWeights, draw_sentences, make_arpa
from uncom_language.speech.pocketsphinx.pronunciation import pronounce, with_accents
from uncom_language.speech.pocketsphinx.utterance_decoder import PocketSphinxHearing
from uncom_language.speech.recognition.recognizer import Hearing, Recognition, Recognizer, Samples
from uncom_language.speech.recognition.timestamps import shifted

_LOG = logging.getLogger(__name__)
_LONGEST_S = 30.0
_PIECE = SAMPLE_RATE // 20
# How likely a word that is learnt at run time is, in shares of the mean word of the model.
_NEW_WORD_WEIGHT = 20.0
# Made by sim/tools/adapt_to_voices.py: how the model changes for synthesised voices.
SYNTHETIC_VOICES = Path(__file__).parent / "models" / "synthetic_voices.npz"

_BEAMS = {
    "beam": "beam",
    "pbeam": "phone_beam",
    "wbeam": "word_beam",
    "lpbeam": "last_phone_beam",
    "lponlybeam": "only_phone_beam",
}  # PocketSphinx's names and ours


@dataclass(frozen=True, slots=True)
class DecoderWeights:
    """Numbers of the search; see `pocketsphinx_batch -help`."""

    lw: float = 9.0
    wip: float = 0.65
    general_words: int = 2000
    max_active: int = 3000  # states that stay in the search per frame
    # How unlikely a state, the last phone of a word, and a word may be beside the best one to stay in the search for
    # synthesised voices. For people it stays narrower: their sound fits worse, so more would compete for max_active.
    beam: float = 1e-60
    phone_beam: float = 1e-60
    word_beam: float = 1e-40
    last_phone_beam: float = 1e-60
    only_phone_beam: float = 1e-40
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
def _phones() -> frozenset[str]:
    """Return the phones that pronunciations are made of."""
    return frozenset(phone for variants in _dictionary().values() for phones in variants for phone in phones.split())


@cache
def common_words(count: int) -> dict[str, float]:
    """Return the most frequent English words of the wheel's general language model, with their probabilities."""
    logmath = pocketsphinx.LogMath(1.0001)
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

    def _load(self, scene_words: Sequence[str]) -> tuple[Any, ...]:
        vocabulary = {word for sentence in self._sentences for word in sentence} | set(self._general) | set(scene_words)
        arpa = make_arpa(self._sentences, self._general, self._model, scene_words)
        with tempfile.TemporaryDirectory(prefix="uncom_lm_") as folder:
            model, dictionary = Path(folder, "lm.arpa"), Path(folder, "words.dict")
            model.write_text(arpa, encoding="utf-8")
            accented = {word for sentence in self._sentences for word in sentence}
            dictionary.write_text("".join(dictionary_lines(vocabulary, accented)), encoding="utf-8")
            plain = model_folder() / "en-us"
            adapted = make_adapted_model(plain, read_adaptation(SYNTHETIC_VOICES), Path(folder))
            wide = {name: getattr(self._weights, field) for name, field in _BEAMS.items()}
            decoders = (
                self._make_decoder(plain, model, dictionary),
                self._make_decoder(adapted, model, dictionary, **wide),
            )
        # The first utterance of a decoder is scored a little differently from the same sound later: let it be this one.
        noise = np.random.default_rng(0).normal(0.0, 300.0, 2 * SAMPLE_RATE).astype(np.int16)
        hearing = PocketSphinxHearing(decoders, self._weights.alternatives)
        for start in range(0, noise.size, SAMPLE_RATE // 10):
            hearing.feed(noise[start : start + SAMPLE_RATE // 10])
        hearing.finish()
        return decoders

    def _make_decoder(self, acoustic: Path, model: Path, dictionary: Path, **beams: float) -> Any:
        try:
            return pocketsphinx.Decoder(
                hmm=str(acoustic),
                lm=str(model),
                dict=str(dictionary),
                lw=self._weights.lw,
                wip=self._weights.wip,
                maxhmmpf=self._weights.max_active,
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
        """Recognise one utterance; long sound is taken in pieces of at most 30 s."""
        sound = to_int16(resample(as_float(samples), sample_rate))
        piece = round(_LONGEST_S * SAMPLE_RATE)
        starts = range(0, max(sound.size, 1), piece)
        with self._lock:
            parts = [self._hear(sound[start : start + piece]) for start in starts]
        if len(parts) == 1:
            return parts[0]
        offsets = [start / SAMPLE_RATE for start in starts]
        words = tuple(word for part, offset in zip(parts, offsets, strict=True) for word in shifted(part.words, offset))
        return Recognition(words, reason="" if words else parts[0].reason)

    def _hear(self, sound: Int16Array) -> Recognition:
        """Hear a whole utterance piece by piece, as it would have come from a microphone."""
        hearing = PocketSphinxHearing(self._decoders, self._weights.alternatives)
        for start in range(0, sound.size, _PIECE):
            hearing.feed(sound[start : start + _PIECE])
        return hearing.finish()

    def open(self) -> Hearing:
        """Begin an utterance that is decoded while it arrives; it needs the decoders for itself until it ends."""
        return PocketSphinxHearing(self._decoders, self._weights.alternatives)

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
                model.add_word(word, _NEW_WORD_WEIGHT)
            for name, phones in entries[:-1]:
                decoder.add_word(name, phones, False)
            decoder.add_word(*entries[-1], True)  # only now the search is built anew, which takes its time
