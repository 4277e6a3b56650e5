# SPDX-License-Identifier: Apache-2.0
"""How well phrases fit objects: "the biggest red bowl" -> a probability for each object, and for none of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from uncom_perception.objects.attributes.colour import COLOUR_WORDS, colour_probability
from uncom_perception.objects.attributes.lexicon import Lexicon, Likelihoods, Noun, ObjectClass
from uncom_perception.objects.attributes.options import (
    NOUN_LIKELIHOOD,
    PHRASE_MATCH,
    NounLikelihoodOptions,
    PhraseMatchOptions,
)
from uncom_perception.objects.attributes.shape import Shape

FloatArray = npt.NDArray[np.float64]

_IGNORED_WORDS = """a an the this that these those my your his her its our their some any please of other
    another same very really here there it them all both"""
_IGNORED = frozenset(_IGNORED_WORDS.split())
#: word -> (measure, sign): ranks the objects that the rest of the phrase fits
_RANKS: dict[str, tuple[str, int]] = {
    **dict.fromkeys(("big", "large", "huge", "great"), ("size", 1)),
    **dict.fromkeys(("small", "little", "tiny"), ("size", -1)),
    **dict.fromkeys(("tall", "high"), ("height", 1)),
    **dict.fromkeys(("short", "low"), ("height", -1)),
    "long": ("length", 1),
    "wide": ("width", 1),
    "thin": ("width", -1),
    "narrow": ("width", -1),
}
_IRREGULAR = {"smallest": "small", "littlest": "little", "tiniest": "tiny"}


@dataclass(frozen=True, slots=True)
class DescribedObject:
    """What is measured on an object: shape (None without depth), colour shares, size relative to others [any unit].

    nouns (N,) is the log likelihood ratio of each noun of the lexicon, described (N,) how well it fits the description
    of each, 0 to 1. certainty is how sure it is that this is an object at all.
    """

    shape: Shape | None
    colours: Mapping[str, float]
    size: float
    nouns: FloatArray
    described: FloatArray
    certainty: float = 1.0


@dataclass(frozen=True, slots=True)
class Phrase:
    """A noun phrase taken apart."""

    text: str
    noun: Noun | ObjectClass | None  # None: no noun, or one that the lexicon does not know
    unknown_noun: str
    colours: tuple[str, ...]
    ranks: tuple[tuple[str, int, float], ...]  # measure, sign, strength
    shapes: tuple[str, ...]


class PhraseMatcher:
    """Matches phrases to objects by a lexicon."""

    def __init__(
        self,
        lexicon: Lexicon,
        *,
        phrase_match_options: PhraseMatchOptions = PHRASE_MATCH,
        noun_likelihood_options: NounLikelihoodOptions = NOUN_LIKELIHOOD,
    ) -> None:
        """Match by the words of a lexicon."""
        self._phrase_match_options = phrase_match_options
        self._noun_likelihood_options = noun_likelihood_options
        self._lexicon = lexicon
        self._likelihoods = Likelihoods(lexicon.nouns)

    def parse(self, text: str) -> Phrase:
        """Take a phrase apart: the longest known noun at its end, adjectives before it."""
        words = [w for w in "".join(c if c.isalnum() else " " for c in text.lower()).split() if w not in _IGNORED]
        noun: Noun | ObjectClass | None = None
        rest = words
        for start in range(len(words)):
            if len(words) == 1 and words[0] in COLOUR_WORDS and self._lexicon.find(words[0]) is None:
                break
            noun = self._lexicon.find(" ".join(words[start:]))
            if noun is not None:
                rest = words[:start]
                break
        unknown = ""
        colours, ranks, shapes = [], [], []
        for i, word in enumerate(rest):
            if word in COLOUR_WORDS:
                colours.append(COLOUR_WORDS[word])
            elif (rank := _rank(word)) is not None:
                ranks.append(rank)
            elif word in _SHAPE_WORDS:
                shapes.append(word)
            elif noun is None and i == len(rest) - 1:
                unknown = word
        return Phrase(text, noun, unknown, tuple(colours), tuple(ranks), tuple(shapes))

    def describe(
        self,
        shape: Shape | None,
        colours: Mapping[str, float],
        size: float,
        hidden: float = 0.0,
        certainty: float = 1.0,
    ) -> DescribedObject:
        """Return an object, a share of which may be hidden, with what every noun makes of its measures."""
        ratios, kept = self._likelihoods.of(shape, colours, hidden)
        candidate = DescribedObject(shape, colours, size, ratios, np.exp(kept), certainty)
        return candidate if shape is None else replace(candidate, colours=self._as_usual(candidate))

    def _as_usual(self, candidate: DescribedObject) -> Mapping[str, float]:
        """Return the shares of colour names that an object's own kind makes likelier: spoons are grey, not white.

        How light a surface is cannot be told from how light its picture is; who names its colour knows what it is.
        """
        name, sure = self.label(candidate)
        usual = self._lexicon.nouns[name].colours
        if not usual:
            return candidate.colours
        likely = {
            c: share * (1.0 - sure + sure * usual.get(c, self._noun_likelihood_options.unusual_colour))
            for c, share in candidate.colours.items()
        }
        total = max(sum(likely.values()), 1e-9)
        return dict(sorted(((c, share / total) for c, share in likely.items()), key=lambda pair: -pair[1]))

    def label(self, candidate: DescribedObject) -> tuple[str, float]:
        """Return the best noun for an object and its probability among all nouns (and an unknown kind of object)."""
        own = [i for i, name in enumerate(self._likelihoods.names) if self._lexicon.nouns[name].own]
        told = max(own, key=lambda i: float(candidate.described[i]), default=-1)
        if told >= 0 and candidate.described[told] > self._phrase_match_options.sure_description:
            return self._likelihoods.names[told], float(
                self._phrase_match_options.description_trust * candidate.described[told]
            )
        best = int(candidate.nouns.argmax())
        top = max(float(candidate.nouns[best]), 0.0)
        total = float(np.exp(candidate.nouns - top).sum()) + math.exp(-top)
        return self._likelihoods.names[best], math.exp(float(candidate.nouns[best]) - top) / total

    def fits(self, text: str, objects: Sequence[DescribedObject]) -> FloatArray:
        """Return for each object (N,) how well a phrase fits it by itself, 0 to 1; ranks look at the others too."""
        phrase = self.parse(text)
        fit = np.array([self._noun_fit(phrase, candidate) * candidate.certainty for candidate in objects])
        fit *= self._adjective_fits(phrase, objects)
        loose = 1.0 - fit.max(initial=0.0) / self._phrase_match_options.plain_fit
        if loose > 0.0:  # nothing is plainly called so: a cereal box is a box, too, and a mug a cup
            kinds = np.array([self._kind_fit(phrase, candidate) * candidate.certainty for candidate in objects])
            fit = np.maximum(fit, loose * kinds * self._adjective_fits(phrase, objects))
        for measure, sign, strength in phrase.ranks:
            fit = _ranked(fit, objects, measure, sign, strength)
        return fit

    def _adjective_fits(self, phrase: Phrase, objects: Sequence[DescribedObject]) -> FloatArray:
        fit = np.ones(len(objects))
        for i, candidate in enumerate(objects):
            for colour in phrase.colours:
                fit[i] *= max(colour_probability(candidate.colours, colour), 0.01)
            for shape in phrase.shapes:
                fit[i] *= max(_SHAPE_WORDS[shape](candidate.shape), 0.05) if candidate.shape is not None else 0.5
        return fit

    def match(self, text: str, objects: Sequence[DescribedObject]) -> tuple[FloatArray, float]:
        """Return the probability that a phrase means each object (N,), and none of them; together they sum to 1."""
        fit = np.clip(self.fits(text, objects), 0.0, 0.995)
        none = float(np.prod(1.0 - fit)) if len(fit) else 1.0
        total = float(fit.sum())
        if math.isclose(total, 0.0, abs_tol=1e-9):
            return np.zeros(len(objects)), 1.0
        return fit / total * (1.0 - none), none

    def _noun_fit(self, phrase: Phrase, candidate: DescribedObject) -> float:
        if phrase.noun is None:
            return self._phrase_match_options.unknown_noun_fit if phrase.unknown_noun else 0.9
        if isinstance(phrase.noun, ObjectClass):
            return 0.95 if phrase.noun.fits_everything else self._class_fit(phrase.noun, candidate)
        names = self._likelihoods.names
        index = names.index(phrase.noun.name)
        relative = _against_others(candidate.nouns, index, [index])
        # What users describe means what they describe, whatever else it may be called.
        described = (
            self._phrase_match_options.description_trust * float(candidate.described[index]) if phrase.noun.own else 0.0
        )
        return max(relative, described)

    def _kinds(self, noun: Noun) -> list[int]:
        """Return the nouns that are kinds of another by their names, as a cereal box is of a box, or loosely."""
        names = enumerate(self._likelihoods.names)
        return [i for i, name in names if name.endswith(f" {noun.name}") or name in noun.loosely]

    def _kind_fit(self, phrase: Phrase, candidate: DescribedObject) -> float:
        """Return how well an object fits some kind of what a phrase names."""
        if not isinstance(phrase.noun, Noun):
            return 0.0
        own = [self._likelihoods.names.index(phrase.noun.name), *self._kinds(phrase.noun)]
        return self._phrase_match_options.kind_trust * max(
            (_against_others(candidate.nouns, kind, own) for kind in own[1:]), default=0.0
        )

    def _class_fit(self, kind: ObjectClass, candidate: DescribedObject) -> float:
        top = max(0.0, float(candidate.nouns.max()))
        weights = np.exp(candidate.nouns - top)
        member = [kind.name in self._lexicon.nouns[name].is_a for name in self._likelihoods.names]
        return float(weights[member].sum() / (weights.sum() + math.exp(-top)))


def _against_others(nouns: FloatArray, index: int, own: Sequence[int]) -> float:
    """Return how well a noun fits by the log likelihood ratios of all (N,): the best one not its own speaks against it.

    It does so at half weight, as who says the word means such an object.
    """
    mine = float(nouns[index])
    other = max(float(np.delete(nouns, own).max(initial=-50.0)), 0.0)
    return 1.0 / (1.0 + 0.5 * math.exp(float(np.clip(other - mine, -30.0, 30.0))) + 0.1 * math.exp(min(30.0, -mine)))


def _between(value: float, low: float, high: float) -> float:
    """Rise softly from 0 at low to 1 at high."""
    return float(np.clip((value - low) / (high - low), 0.0, 1.0))


_SHAPE_WORDS = {
    "round": lambda s: _between(s.roundness, 0.55, 0.8),
    "square": lambda s: _between(s.rectangularity, 0.82, 0.9) * _between(-s.elongation, -1.5, -1.15),
    "rectangular": lambda s: _between(s.rectangularity, 0.82, 0.9),
    "flat": lambda s: _between(-s.flatness, -0.35, -0.15),
    "hollow": lambda s: _between(s.hollowness, 0.05, 0.3),
    "empty": lambda s: 0.5 + 0.5 * _between(s.hollowness, 0.05, 0.3),
    "curved": lambda s: _between(s.curvature, 0.03, 0.08),
    "bent": lambda s: _between(s.curvature, 0.03, 0.08),
    "elongated": lambda s: _between(s.elongation, 1.5, 2.5),
}


def _rank(word: str) -> tuple[str, int, float] | None:
    """Read an adjective of size: plain ones rank softly, comparatives and superlatives sharply."""
    if word in _RANKS:
        return (*_RANKS[word], 2.5)
    if word in _IRREGULAR:
        return (*_RANKS[_IRREGULAR[word]], 8.0)
    for ending, strength in (("est", 8.0), ("er", 6.0)):
        if word.endswith(ending):
            stem = word[: -len(ending)]
            for base in (stem, stem + "e", stem[:-1]):
                if base in _RANKS:
                    return (*_RANKS[base], strength)
    return None


def _ranked(
    fit: FloatArray, objects: Sequence[DescribedObject], measure: str, sign: int, strength: float
) -> FloatArray:
    """Weigh the objects that fit so far by their rank in a measure."""
    if len(fit) == 0:
        return fit
    values = np.array(
        [t.size if measure == "size" or t.shape is None else float(getattr(t.shape, measure)) for t in objects]
    )
    matched = fit > 0.35 * fit.max()
    score = sign * np.log(np.maximum(values, 1e-4))
    return np.asarray(fit * np.exp(np.clip(strength * (score - score[matched].max()), -12.0, 0.0)))
