# SPDX-License-Identifier: Apache-2.0
"""A trigram model of tabletop speech, counted from sentences drawn from our own patterns and lexicon.

The model interpolates with fixed weights (Jelinek and Mercer 1980), so every word sequence over the vocabulary keeps
a probability: p(w | u v) = (1 - b3) f(w | u v) + b3 p(w | v), and so on down to single words, which mix the patterns'
words with common English ones. Written as ARPA, in which the back-off weights are b3 and b2.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from uncom_language.exceptions import LexiconError, UnknownLanguageError
from uncom_language.parser.lexical.lexicon import Lexicon, load_lexicon
from uncom_language.speech.pocketsphinx.options import LANGUAGE_MODEL, LanguageModelOptions

PACKS = Path(__file__).parent / "packs"
START, END = "<s>", "</s>"


@dataclass(frozen=True)
class Patterns:
    """Weighted rewriting rules."""

    rules: Mapping[str, tuple[tuple[float, tuple[str, ...]], ...]]
    lexicon: Lexicon = field(repr=False)
    max_depth: int = LANGUAGE_MODEL.max_depth

    def draw_sentence(self, rng: random.Random) -> list[str]:
        """Draw one sentence."""
        return list(self._expand("start", rng, 0))

    def _expand(self, name: str, rng: random.Random, depth: int) -> Iterator[str]:
        alternatives = self.rules[name]
        if (
            depth > self.max_depth
        ):  # patterns nest ("the cup next to the one on ..."): end with the first, plainest option
            alternatives = alternatives[:1]
        (_, chosen), *_ = rng.choices(alternatives, weights=[weight for weight, _ in alternatives])
        for symbol in chosen:
            if symbol.startswith("$"):
                yield from self._expand(symbol[1:], rng, depth + 1)
            elif symbol.startswith("@"):
                section, kind = symbol[1:].split(".")
                yield from str(rng.choice(self.lexicon.raw[section][kind])).split()
            else:
                yield symbol


@cache
def load_patterns(language: str = "en") -> Patterns:
    """Read the sentence patterns of a language.

    Raises:
        UnknownLanguageError: no patterns for it.
        LexiconError: the file is broken or names a rule that it lacks.
    """
    path = PACKS / language / "sentences.yaml"
    if not path.is_file():
        raise UnknownLanguageError(language, sorted(found.parent.name for found in PACKS.glob("*/sentences.yaml")))
    try:
        raw = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)  # noqa: S506 - all scalars as text
    except yaml.YAMLError as error:
        raise LexiconError(f"{path} is not YAML: {error}".replace("\n", " ")) from error
    rules = {name: tuple(_parse_alternative(text) for text in alternatives) for name, alternatives in raw.items()}
    for name, alternatives in rules.items():
        for _, symbols in alternatives:
            unknown = [symbol for symbol in symbols if symbol.startswith("$") and symbol[1:] not in rules]
            if unknown:
                raise LexiconError(f"{path}: rule {name!r} uses {unknown[0]!r}, which is not defined")
    return Patterns(rules, load_lexicon(language))


def _parse_alternative(text: str) -> tuple[float, tuple[str, ...]]:
    weight, bar, rest = text.partition("|")
    if not bar:
        return 1.0, tuple(text.replace('"', "").split())
    symbols = tuple(symbol for symbol in rest.replace('"', "").split() if symbol != "/")
    return float(weight), symbols


def draw_sentences(options: LanguageModelOptions, language: str = "en") -> list[list[str]]:
    """Draw the sentences to count; the same ones for the same seed."""
    patterns = load_patterns(language)
    rng = random.Random(options.seed)
    return [sentence for sentence in (patterns.draw_sentence(rng) for _ in range(options.sentences)) if sentence]


def make_arpa(
    sentences: Iterable[Sequence[str]],
    general: Mapping[str, float],
    options: LanguageModelOptions,
    scene_words: Sequence[str] = (),
) -> str:
    """Count sentences into a trigram model in ARPA format.

    Args:
        sentences: words of each sentence.
        general: common words with their relative frequency; they need not be in the sentences.
        options: shares of the levels.
        scene_words: words to make likely now, such as names of things on the table.
    """
    unigrams: Counter[str] = Counter()
    bigrams: Counter[tuple[str, str]] = Counter()
    trigrams: Counter[tuple[str, str, str]] = Counter()
    for words in sentences:
        padded = [START, *words, END]
        unigrams.update(padded[1:])
        bigrams.update(pairwise(padded))
        trigrams.update(zip(padded, padded[1:], padded[2:], strict=False))
    single = _single_words(unigrams, general, options, scene_words)
    pair: dict[tuple[str, str], float] = {}
    context = _context_counts(bigrams)
    for (first, second), count in bigrams.items():
        share = count / context[first]
        pair[first, second] = (1 - options.bigram_backoff) * share + options.bigram_backoff * single[second]
    triple: dict[tuple[str, str, str], float] = {}
    pair_context = _context_counts(trigrams)
    for (first, second, third), count in trigrams.items():
        share = count / pair_context[first, second]
        triple[first, second, third] = (1 - options.trigram_backoff) * share + options.trigram_backoff * pair[
            second, third
        ]
    return "\n".join(_arpa_lines(single, pair, triple, set(context), set(pair_context), options))


def _context_counts(grams: Counter[Any]) -> dict[Any, int]:
    counts: Counter[Any] = Counter()
    for gram, count in grams.items():
        history = gram[:-1]
        counts[history[0] if len(history) == 1 else history] += count
    return counts


def _single_words(
    counts: Counter[str], general: Mapping[str, float], options: LanguageModelOptions, scene_words: Sequence[str]
) -> dict[str, float]:
    scene_share = options.scene_share if scene_words else 0.0
    own_share = 1.0 - options.general_share - scene_share
    total, total_general = sum(counts.values()), sum(general.values())
    single = {word: own_share * count / total for word, count in counts.items()}
    for word, frequency in general.items():
        single[word] = single.get(word, 0.0) + options.general_share * frequency / total_general
    for word in scene_words:
        single[word] = single.get(word, 0.0) + scene_share / len(scene_words)
    return single


def _arpa_lines(
    single: Mapping[str, float],
    pair: Mapping[tuple[str, str], float],
    triple: Mapping[tuple[str, str, str], float],
    contexts: set[str],
    pair_contexts: set[tuple[str, str]],
    options: LanguageModelOptions,
) -> Iterator[str]:
    bow2 = math.log10(options.bigram_backoff)
    bow3 = math.log10(options.trigram_backoff)
    yield "\\data\\"
    yield f"ngram 1={len(single) + 1}"
    yield f"ngram 2={len(pair)}"
    yield f"ngram 3={len(triple)}"
    yield ""
    yield "\\1-grams:"
    yield f"-99.0\t{START}\t{bow2:.4f}"
    for word in sorted(single):
        backoff = f"\t{bow2:.4f}" if word in contexts else ""
        yield f"{math.log10(single[word]):.4f}\t{word}{backoff}"
    yield ""
    yield "\\2-grams:"
    for words in sorted(pair):
        backoff = f"\t{bow3:.4f}" if words in pair_contexts else ""
        yield f"{math.log10(pair[words]):.4f}\t{' '.join(words)}{backoff}"
    yield ""
    yield "\\3-grams:"
    for trigram in sorted(triple):
        yield f"{math.log10(triple[trigram]):.4f}\t{' '.join(trigram)}"
    yield ""
    yield "\\end\\"
    yield ""
