# SPDX-License-Identifier: Apache-2.0
"""The words of a language: a lexicon file read into phrases with their classes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from uncom_language.exceptions import LexiconError, UnknownLanguageError

PACKS = Path(__file__).parents[1] / "packs"

Phrase = tuple[str, ...]
_SHORTEST_PLURAL = len("cups")


@dataclass(frozen=True, slots=True)
class Meaning:
    """One class a phrase can have (a terminal of the grammar) and what it stands for."""

    tag: str
    value: str
    detail: str = ""


@dataclass(frozen=True)
class Lexicon:
    """Phrases to their meanings, and the lists around commands."""

    language: str
    phrases: Mapping[Phrase, tuple[Meaning, ...]]
    longest: int
    noun_class: Mapping[str, str]
    generic: frozenset[str]
    place_nouns: frozenset[str]
    singular: Mapping[str, str]
    acts: Mapping[Phrase, str]
    social: frozenset[Phrase]
    fillers: frozenset[Phrase]
    hesitations: frozenset[Phrase]
    determiners: frozenset[str]
    repairs: frozenset[Phrase]
    negations: frozenset[Phrase]
    function_words: frozenset[str]
    releases: frozenset[str]
    amends: frozenset[Phrase]
    amends_after: frozenset[Phrase]
    questions: frozenset[Phrase]
    idioms: frozenset[Phrase]
    numbers: Mapping[Phrase, float]
    units: Mapping[str, float]
    before_distance: frozenset[Phrase]
    directed: frozenset[str]
    toward: frozenset[str]
    instead: frozenset[str]
    definite: frozenset[str]
    one: str
    ones: frozenset[str]
    many: frozenset[str]
    other_determiners: frozenset[str]
    put_down: frozenset[str]
    push_directions: Mapping[str, str]
    concepts: Mapping[str, str]
    head_index: int
    raw: Mapping[str, Any] = field(repr=False)

    def longest_match(self, words: tuple[str, ...], start: int) -> tuple[int, tuple[Meaning, ...]]:
        """Return how many words from `start` make the longest known phrase, and its meanings; (0, ()) if none."""
        for length in range(min(self.longest, len(words) - start), 0, -1):
            found = self.phrases.get(words[start : start + length])
            if found:
                return length, found
        return 0, ()

    def singular_of(self, word: str) -> str:
        """Return the singular of a noun, also of one that is not listed if plurals follow a rule."""
        if word in self.singular or word in self.noun_class or self.raw["plural_rule"] != "s":
            return self.singular.get(word, word)
        if len(word) < _SHORTEST_PLURAL or not word.endswith("s") or word.endswith(("ss", "us", "is")):
            return word
        if word.endswith("ies"):
            return word[:-3] + "y"
        return word[:-2] if word.endswith(("ches", "shes", "xes", "sses")) else word[:-1]


def phrase(text: str) -> Phrase:
    """Split a lexicon entry into its words."""
    return tuple(str(text).split())


def plural_of(noun: str, irregular: Mapping[str, str]) -> str:
    """Return the plural of a (compound) noun; its last word changes."""
    *rest, last = noun.split()
    if noun in irregular:
        return irregular[noun]
    if last in irregular:
        made = irregular[last]
    elif last.endswith(("s", "x", "ch", "sh", "z")):
        made = last + "es"
    elif last.endswith("y") and last[-2:-1] not in "aeiou":
        made = last[:-1] + "ies"
    elif last.endswith(("tomato", "potato", "mango")):
        made = last + "es"
    else:
        made = last + "s"
    return " ".join([*rest, made])


def available_languages() -> tuple[str, ...]:
    """Return the names of the shipped language packs."""
    return tuple(sorted(path.parent.name for path in PACKS.glob("*/lexicon.yaml")))


@cache
def load_lexicon(language: str = "en") -> Lexicon:
    """Read the lexicon of a language pack.

    Raises:
        UnknownLanguageError: there is no such pack.
        LexiconError: the file lacks a section or is not YAML.
    """
    path = PACKS / language / "lexicon.yaml"
    if not path.is_file():
        raise UnknownLanguageError(language, available_languages())
    try:
        # BaseLoader: every scalar is text, so that yes, no, on and off stay words.
        raw = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)  # noqa: S506
        return lexicon_from_data(language, raw)
    except yaml.YAMLError as error:
        raise LexiconError(f"{path} is not YAML: {error}".replace("\n", " ")) from error
    except (KeyError, TypeError, AttributeError) as error:
        raise LexiconError(f"{path}: section missing or of the wrong kind: {error}") from error


def lexicon_from_data(language: str, raw: Mapping[str, Any]) -> Lexicon:
    """Build a lexicon from the contents of a lexicon file."""
    table, singular, noun_class = _phrase_table(raw)
    fillers, repairs = _phrases(raw, "fillers"), _phrases(raw, "repairs")
    return Lexicon(
        language=language,
        phrases={key: tuple(value) for key, value in table.items()},
        longest=max(len(key) for key in [*table, *fillers, *repairs]),
        noun_class=noun_class,
        generic=frozenset(raw["generic_nouns"]),
        place_nouns=frozenset(raw["place_nouns"]),
        singular=singular,
        acts={phrase(text): act for act, texts in raw["acts"].items() for text in texts},
        social=_phrases(raw, "social"),
        fillers=fillers,
        hesitations=_phrases(raw, "hesitations"),
        determiners=frozenset([*raw["determiners"], *raw["deictics"]]),
        repairs=repairs,
        negations=_phrases(raw, "negations"),
        function_words=frozenset(raw["function_words"]),
        releases=frozenset(raw["releases"]),
        amends=_phrases(raw, "amends"),
        amends_after=_phrases(raw, "amends_after"),
        questions=_phrases(raw, "questions"),
        idioms=_phrases(raw, "idioms"),
        numbers={phrase(text): float(value) for text, value in raw["numbers"].items()},
        units={unit: float(value) for unit, value in raw["units"].items()},
        before_distance=_phrases(raw, "before_distance"),
        directed=frozenset(raw["directed"]),
        toward=frozenset(raw["toward"]),
        instead=frozenset(raw["instead"]),
        definite=frozenset(raw["definite"]),
        one=str(raw["ones"][0]),
        ones=frozenset([*raw["ones"], *raw["generic_nouns"], *raw["many"]]),
        many=frozenset(raw["many"]),
        other_determiners=frozenset(raw["other_determiners"]),
        put_down=frozenset(raw["put_down"]),
        push_directions=raw["ways"],
        concepts=raw.get("english", {}),
        head_index=-1 if raw["head"] == "last" else 0,
        raw=raw,
    )


def _phrase_table(
    raw: Mapping[str, Any],
) -> tuple[dict[Phrase, list[Meaning]], dict[str, str], dict[str, str]]:
    """Return all phrases with their meanings, the singulars of plurals, and the classes of nouns."""
    table: dict[Phrase, list[Meaning]] = {}
    for text, meaning in _entries(raw):
        held = table.setdefault(phrase(text), [])
        if all(meaning.tag != other.tag for other in held):
            held.append(meaning)
    singular: dict[str, str] = {}
    noun_class: dict[str, str] = {}
    for kind, noun in _nouns(raw):
        plural = plural_of(noun, raw["plurals"]) if raw["plural_rule"] == "s" else raw["plurals"].get(noun, noun)
        noun_class.setdefault(noun, kind)
        if plural != noun:
            singular.setdefault(plural, noun)
            held = table.setdefault(phrase(plural), [])
            if all(meaning.tag != "NOUN" for meaning in held):
                held.append(Meaning("NOUN", noun, "plural"))
    return table, singular, noun_class


def _phrases(raw: Mapping[str, Any], section: str) -> frozenset[Phrase]:
    return frozenset(phrase(text) for text in raw[section])


def _nouns(raw: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for kind, nouns in raw["nouns"].items():
        yield from ((kind, noun) for noun in nouns)
    yield from (("generic", noun) for noun in raw["generic_nouns"])
    yield from (("place", noun) for noun in raw["place_nouns"])


def _entries(raw: Mapping[str, Any]) -> Iterator[tuple[str, Meaning]]:
    for verb in raw["verbs"]:
        yield from _each([*verb["words"], *verb["gerunds"]], "VERB", verb["kind"])
        yield from _each(verb["participles"], "PARTICIPLE", verb["kind"])
    for section, tag in _PLAIN_SECTIONS.items():
        yield from _each(raw[section], tag, "")
    for kind, noun in _nouns(raw):
        yield noun, Meaning("NOUN", noun, kind)
    for kind, words in raw["adjectives"].items():
        for ending in raw["adjective_endings"]:
            yield from _each([word + ending for word in words], "ADJECTIVE", kind)
    for section, tag in _VALUED_SECTIONS.items():
        for text, value in raw[section].items():
            yield text, Meaning(tag, value)
    for section, tag in _LISTED_SECTIONS.items():
        for value, texts in raw[section].items():
            yield from _each(texts, tag, value)
    yield from _counted(raw)
    yield from _likenesses(raw)


def _counted(raw: Mapping[str, Any]) -> Iterator[tuple[str, Meaning]]:
    """Yield words with numbers: ordinals and pronouns."""
    for text, number in raw["ordinals"].items():
        for ending in raw["adjective_endings"]:
            yield text + ending, Meaning("ADJECTIVE", "ordinal", number)
    for canonical, counted in raw["pronouns"].items():
        for text, count in counted.items():
            yield text, Meaning("PRONOUN", count, canonical)


def _likenesses(raw: Mapping[str, Any]) -> Iterator[tuple[str, Meaning]]:
    """Yield "with the same colour as", "with a different size than", "of this shape"."""
    for value, words in raw["same"].items():
        for word in words:
            for prefix, section in (("same", "same_templates"), ("other", "different_templates")):
                yield from _each(
                    [template.replace("X", word) for template in raw[section]], "COMPARED", f"{prefix}_{value}"
                )
            for deictic in raw["deictics"]:
                made = [template.replace("X", deictic).replace("Y", word) for template in raw["these_templates"]]
                yield from _each(made, "LIKETHIS", f"same_{value}", deictic)


_PLAIN_SECTIONS = {
    "going": "GOING",
    "particles": "PARTICLE",
    "others": "OTHER",
    "determiners": "DETERMINER",
    "ones": "ONE",
    "to": "TO",
    "between": "BETWEEN",
    "relative": "RELATIVE",
    "recipients": "RECIPIENT",
    "pointing": "POINTED",
    "joins": "AND",
    "thens": "THEN",
    "of": "OF",
    "persons": "PERSON",
    "as": "AS",
    "except": "EXCEPT",
    "not": "NOT",
    "relative_not": "RELATIVE_NOT",
}
_VALUED_SECTIONS = {"counts": "COUNT", "deictics": "DEICTIC", "sources": "SOURCE", "distances": "DISTANCE"}
_LISTED_SECTIONS = {
    "relations": "RELATION",
    "places": "PLACE",
    "sides": "SIDE",
    "comparisons": "COMPARED",
    "same_before": "SAME",
}


def _each(texts: Iterable[str], tag: str, value: str, detail: str = "") -> Iterator[tuple[str, Meaning]]:
    for text in texts:
        yield text, Meaning(tag, value, detail)
