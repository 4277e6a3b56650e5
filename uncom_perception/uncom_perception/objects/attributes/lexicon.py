# SPDX-License-Identifier: Apache-2.0
"""Words for objects, described by what can be measured; see lexicon.yaml."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from uncom_perception.exceptions import InvalidLexiconError
from uncom_perception.objects.attributes.colour import COLOUR_NAMES, colour_probabilities
from uncom_perception.objects.attributes.options import NOUN_LIKELIHOOD, NounLikelihoodOptions
from uncom_perception.objects.attributes.shape import Shape

FloatArray = npt.NDArray[np.float64]

#: What measures of household objects range over; how special a range is, is its share of this (on a log scale if > 0).
_BOUNDS: dict[str, tuple[float, float]] = {
    "length": (0.03, 0.4),
    "width": (0.01, 0.3),
    "height": (0.004, 0.4),
    "elongation": (1.0, 8.0),
    "flatness": (0.03, 4.0),
    "roundness": (0.0, 1.0),
    "rectangularity": (0.6, 1.0),
    "hollowness": (0.0, 1.0),
    "cavity": (0.0, 1.0),
    "handle": (0.0, 0.2),
    "curvature": (0.0, 0.3),
    "flat_top": (0.0, 1.0),
    "neck": (0.1, 2.0),
    "taper": (0.3, 2.5),
}
_MEASURES = tuple(_BOUNDS)
_IS_HEIGHT = np.array([name == "height" for name in _MEASURES])
_ABSOLUTE_SOFTNESS = {"handle": 0.008, "curvature": 0.03, "hollowness": 0.08, "cavity": 0.15, "roundness": 0.07}


@dataclass(frozen=True, slots=True)
class Noun:
    """What one word for an object means; loosely it is used for other nouns, where nothing is plainly called so."""

    name: str
    aliases: tuple[str, ...] = ()
    is_a: tuple[str, ...] = ()
    colours: Mapping[str, float] = field(default_factory=dict)
    shape: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    own: bool = False  # described by the user
    loosely: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ObjectClass:
    """A word for a kind of objects; fits everything if told so."""

    name: str
    aliases: tuple[str, ...] = ()
    fits_everything: bool = False


class Likelihoods:
    """How likely the measures of an object are for every noun at once."""

    def __init__(self, nouns: Mapping[str, Noun], *, options: NounLikelihoodOptions = NOUN_LIKELIHOOD) -> None:
        """Put the ranges of all nouns into arrays (nouns, measures)."""
        self._options = options
        self.names = tuple(nouns)
        shape = (len(nouns), len(_BOUNDS))
        self._low, self._high = np.full(shape, -np.inf), np.full(shape, np.inf)
        self._soft_low, self._soft_high, self._log_mass = np.ones(shape), np.ones(shape), np.zeros(shape)
        self._colours = np.zeros((len(nouns), len(COLOUR_NAMES)))
        self._with_colour = np.array([bool(noun.colours) for noun in nouns.values()])
        self._colour_log_mass = np.zeros(len(nouns))
        for i, noun in enumerate(nouns.values()):
            for name, (low, high) in noun.shape.items():
                j = _MEASURES.index(name)
                self._low[i, j], self._high[i, j] = low, high
                self._soft_low[i, j], self._soft_high[i, j] = _softness(name, low), _softness(name, high)
                self._log_mass[i, j] = math.log(_mass(name, low, high, options=self._options))
            for colour, weight in noun.colours.items():
                self._colours[i, COLOUR_NAMES.index(colour)] = weight
            if noun.colours:
                mass = max(self._options.least_colour_mass, sum(noun.colours.values()) / len(COLOUR_NAMES))
                self._colour_log_mass[i] = math.log(mass)

    def of(
        self, shape: Shape | None, colours: Mapping[str, float], hidden: float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """Return how likely the measures make each noun (N,), and how well they keep to its description (N,).

        Both are logarithms: P(measures | noun) / P(measures | any object), and 0 for a perfect fit. Of an object
        that is partly hidden (0 to 1) all measures but the height say less.
        """
        total = np.zeros(len(self.names))
        kept = np.zeros(len(self.names))
        if shape is not None:
            x = np.array([getattr(shape, name) for name in _MEASURES])
            off = np.maximum(np.maximum((self._low - x) / self._soft_low, (x - self._high) / self._soft_high), 0.0)
            trust = np.where(_IS_HEIGHT, 1.0, 1.0 - 0.75 * hidden)
            fits = np.maximum(-0.5 * off * off, math.log(self._options.least_fit))
            total += (fits - self._log_mass) @ trust
            kept += fits @ trust
        fit = (self._colours * colour_probabilities(colours)).max(axis=1)
        colour = np.where(self._with_colour, np.log(np.maximum(fit, self._options.unusual_colour)), 0.0)
        return total + colour - self._colour_log_mass, kept + colour


@dataclass(frozen=True)
class Lexicon:
    """All words; finds one by any of its names."""

    nouns: Mapping[str, Noun]
    classes: Mapping[str, ObjectClass]

    def find(self, words: str) -> Noun | ObjectClass | None:
        """Return what a noun of one or more words (singular or plural) means, or None."""
        for name in _singulars(words):
            entries: list[Noun | ObjectClass] = [*self.nouns.values(), *self.classes.values()]
            for entry in entries:
                if name == entry.name or name in entry.aliases:
                    return entry
        return None

    def same(self, one: str, other: str) -> bool:
        """Whether two words mean the same kind of object."""
        a, b = one.lower().replace("_", " ").strip(), other.lower().replace("_", " ").strip()
        first = self.find(a)
        return a == b or (first is not None and first == self.find(b))


def load_lexicon(extra: str | Path | None = None) -> Lexicon:
    """Read the package's lexicon, and a user's file whose entries are added to it or replace it.

    Raises:
        InvalidLexiconError: the file cannot be read or is not of the form that lexicon.yaml describes.
    """
    text = resources.files("uncom_perception.objects.attributes").joinpath("lexicon.yaml").read_text(encoding="utf-8")
    base = _parsed(text, "lexicon.yaml")
    if not extra:
        return base
    path = Path(extra)
    try:
        own = _parsed(path.read_text(encoding="utf-8"), path.name)
    except OSError as error:
        raise InvalidLexiconError(f"cannot read the lexicon {path}: {error.strerror or error}") from error
    described = {name: replace(noun, own=True) for name, noun in own.nouns.items()}
    return Lexicon({**base.nouns, **described}, {**base.classes, **own.classes})


def _parsed(text: str, name: str) -> Lexicon:
    try:
        data = yaml.safe_load(text) or {}
    except yaml.YAMLError as error:
        where = " ".join(str(error).split())
        raise InvalidLexiconError(f"lexicon {name} is not YAML: {where}") from error
    if not isinstance(data, dict) or set(data) - {"things", "classes"}:
        raise InvalidLexiconError(f"lexicon {name} needs the keys 'things' and 'classes' only")
    nouns = {str(k): _noun(str(k), v, name) for k, v in (data.get("things") or {}).items()}
    classes = {}
    for key, value in (data.get("classes") or {}).items():
        entry = _mapping(value, name, key, {"aliases", "all"})
        classes[str(key)] = ObjectClass(str(key), tuple(entry.get("aliases") or ()), bool(entry.get("all", False)))
    return Lexicon(nouns, classes)


def _mapping(value: Any, name: str, key: object, known: set[str]) -> dict[str, Any]:
    entry = {} if value is None else value
    if not isinstance(entry, dict) or set(entry) - known:
        raise InvalidLexiconError(f"lexicon {name}: entry {key!r} may hold only {', '.join(sorted(known))}")
    return entry


def _noun(key: str, value: Any, name: str) -> Noun:
    entry = _mapping(value, name, key, {"aliases", "is_a", "loosely", "colours", "shape"})
    colours = _mapping(entry.get("colours"), name, f"{key}.colours", set(COLOUR_NAMES))
    shape = _mapping(entry.get("shape"), name, f"{key}.shape", {f.name for f in fields(Shape)})
    try:
        ranges = {k: (float(low), float(high)) for k, (low, high) in shape.items()}
        weights = {k: float(v) for k, v in colours.items()}
    except (TypeError, ValueError) as error:
        raise InvalidLexiconError(f"lexicon {name}: {key!r} needs ranges [low, high] and colour weights") from error
    if any(low > high for low, high in ranges.values()):
        raise InvalidLexiconError(f"lexicon {name}: {key!r} has a range whose low end is above its high end")
    aliases, is_a, loosely = (tuple(str(word) for word in entry.get(k) or ()) for k in ("aliases", "is_a", "loosely"))
    return Noun(key, aliases, is_a, weights, ranges, loosely=loosely)


def _softness(name: str, bound: float) -> float:
    return _ABSOLUTE_SOFTNESS.get(name, max(0.14 * abs(bound), 0.003))


def _mass(name: str, low: float, high: float, *, options: NounLikelihoodOptions = NOUN_LIKELIHOOD) -> float:
    least, most = _BOUNDS[name]
    if least > 0.0:
        low, high = max(low, least), min(high, most)
        mass = math.log(max(high, low * 1.0001) / low) / math.log(most / least)
    else:
        mass = (min(high, most) - max(low, least)) / (most - least)
    return min(1.0, max(options.least_range_mass, mass))


def _singulars(words: str) -> list[str]:
    """Return the words as they are and with the last one in the singular."""
    forms = [words]
    if words.endswith("ies"):
        forms.append(words[:-3] + "y")
    if words.endswith("ves"):
        forms += [words[:-3] + "f", words[:-3] + "fe"]
    if words.endswith("es"):
        forms.append(words[:-2])
    if words.endswith("s") and not words.endswith("ss"):
        forms.append(words[:-1])
    return forms
