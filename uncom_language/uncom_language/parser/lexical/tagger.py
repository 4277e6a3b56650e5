# SPDX-License-Identifier: Apache-2.0
"""Words to classes of words: the terminals of the grammar. Ambiguous words are settled by their neighbours."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping, Sequence

from uncom_language.parser.lexical.conjunctions import resolve_conjunctions
from uncom_language.parser.lexical.lexicon import Lexicon, Meaning
from uncom_language.parser.lexical.tokens import PREMODIFIERS, RawToken, Token
from uncom_language.parser.options import PARSER

# After these an unknown word is taken for a noun.
_TAGS_BEFORE_NOUN = PREMODIFIERS | {
    "NOUN",
    "VERB",
    "RELATION",
    "TO",
    "SOURCE",
    "BETWEEN",
    "COMPARED",
    "OF",
    "AND",
    "PARTICLE",
    "RECIPIENT",
    "AS",
    "EXCEPT",
}
_PLACE_OPENING_TAGS = ("RELATION", "TO")
_PLACE_CONTENT_TAGS = frozenset(("RELATION", "PLACE", "BETWEEN"))
_TOKEN_PATTERN = re.compile(r"\d+(?:[.,]\d+)?|[^\W\d_](?:[^\W\d_]|')*|[.;!?,:]")


def split_text(text: str) -> tuple[RawToken, ...]:
    """Split a line into lower-case words and breaks."""
    items: list[RawToken] = []
    count = 0
    cleaned = text.lower().replace("\N{RIGHT SINGLE QUOTATION MARK}", "'").replace("-", " ").replace("_", " ")
    for match in _TOKEN_PATTERN.finditer(cleaned):
        piece = match.group().strip("'")
        if not piece:
            continue
        if piece in ".;!?,:":
            items.append(RawToken(piece, max(0, count - 1), is_break=True))
        else:
            items.append(RawToken(piece, count))
            count += 1
    return tuple(items)


def remove_fillers(items: Sequence[RawToken], lexicon: Lexicon) -> list[RawToken]:
    """Remove hesitation and politeness, longest phrase first, unless a longer phrase of the lexicon covers them."""
    words_only = [item for item in items if (item.text,) not in lexicon.hesitations]
    kept: list[RawToken] = []
    position = 0
    words = tuple(item.text for item in words_only)
    while position < len(words_only):
        length = _longest(words, position, lexicon.fillers, lexicon.longest)
        known = lexicon.longest_match(words, position)[0]
        named = bool(kept) and kept[-1].text in lexicon.determiners and not kept[-1].is_break
        if length >= max(1, known) and not named:
            position += length
            continue
        step = max(1, known)
        kept.extend(words_only[position : position + step])
        position += step
    return kept


def remove_repetitions(items: Sequence[RawToken]) -> tuple[RawToken, ...]:
    """Remove words that are said twice in a row: "put the put the lemon in in the bowl"."""
    kept: list[RawToken] = []
    for item in items:
        kept.append(item)
        for length in range(min(PARSER.max_repeated_words, len(kept) // 2), 0, -1):
            again, before = kept[-length:], kept[-2 * length : -length]
            if [item.text for item in again] == [item.text for item in before]:
                del kept[-2 * length : -length]
                break
    return tuple(kept)


def remove_false_starts(items: Sequence[RawToken], tokens: Sequence[Token]) -> tuple[RawToken, ...]:
    """Remove relations that are given up for the next word: "place this in on the plate", "to the into the box".

    After a pause a recogniser may also hear a short word where the voice only sets in.
    """
    abandoned: set[int] = set()
    for number, token in enumerate(tokens):
        ahead = [other.tag for other in tokens[number + 1 : number + 3]]
        length = 2 if ahead[:1] == ["DETERMINER"] else 1
        if token.tag in _PLACE_OPENING_TAGS and set(ahead[length - 1 : length]) & _PLACE_CONTENT_TAGS:
            abandoned.update(range(token.first, tokens[number + length - 1].last + 1))
    return tuple(item for item in items if item.index not in abandoned or item.is_break)


def _longest(words: tuple[str, ...], start: int, phrases: Container[tuple[str, ...]], limit: int) -> int:
    for length in range(min(limit, len(words) - start), 0, -1):
        if words[start : start + length] in phrases:
            return length
    return 0


def _number(words: tuple[str, ...], start: int) -> float | None:
    word = words[start].replace(",", ".") if start < len(words) else ""
    return float(word) if word.replace(".", "", 1).isdecimal() else None


class Tagger:
    """Gives every phrase of an utterance its class."""

    def __init__(self, lexicon: Lexicon) -> None:
        """Take the words of a language."""
        self._lexicon = lexicon

    def tag(self, items: Sequence[RawToken], forced: Mapping[int, str] | None = None) -> list[Token]:
        """Return the tokens; a word that fits nowhere gets the class UNKNOWN.

        Args:
            items: the words.
            forced: classes that were found out otherwise, by the index of a phrase's first word.
        """
        words = tuple("," if item.is_break else item.text for item in items)
        tokens: list[Token] = []
        position = 0
        while position < len(items):
            if items[position].is_break:
                position += 1
                continue
            length, meaning = self._meaning(words, position, tokens, (forced or {}).get(items[position].index, ""))
            text = " ".join(words[position : position + length])
            first, last = items[position].index, items[position + length - 1].index
            tokens.append(Token(meaning.tag, meaning.value or text, text, first, last, meaning.detail))
            position += length
        stops = {item.index for item in items if item.is_break and item.text != ","}
        return resolve_conjunctions(tokens, stops, {item.index for item in items if item.is_break} - stops)

    def _meaning(self, words: tuple[str, ...], position: int, tokens: list[Token], forced: str) -> tuple[int, Meaning]:
        """Return how many words make the next phrase, and what it is."""
        length, metres = self._distance(words, position)
        if length:
            return length, Meaning("DISTANCE", str(metres))
        previous = tokens[-1] if tokens else None
        length, meanings = self._lexicon.longest_match(words, position)
        found = next((meaning for meaning in meanings if meaning.tag == forced), None)
        if found is not None:
            return length, found
        if forced == "NOUN" and not meanings:
            return 1, Meaning("NOUN", words[position], "unknown")
        if meanings:
            return length, self._choose(meanings, previous, words, position + length)
        if words[position].isdecimal():
            return 1, Meaning("COUNT", words[position])
        return 1, self._unknown(words[position], previous)

    def _distance(self, words: tuple[str, ...], position: int) -> tuple[int, float]:
        """Return the length and value [m] of a number with its unit, (0, 0) if there is none."""
        lexicon = self._lexicon
        lead = _longest(words, position, lexicon.before_distance, PARSER.max_number_words)
        for start in (position + lead, position) if lead else (position,):
            count = _longest(words, start, lexicon.numbers, PARSER.max_number_words)
            value = lexicon.numbers[words[start : start + count]] if count else _number(words, start)
            unit = start + max(count, 1)
            if value is not None and unit < len(words) and words[unit] in lexicon.units:
                return unit + 1 - position, value * lexicon.units[words[unit]]
        return 0, 0.0

    def other_tags(self, items: Sequence[RawToken], token: Token) -> tuple[str, ...]:
        """Return the classes besides its own that a token could have."""
        words = tuple("," if item.is_break else item.text for item in items)
        start = next(i for i, item in enumerate(items) if item.index == token.first and not item.is_break)
        length, meanings = self._lexicon.longest_match(words, start)
        if length != token.last - token.first + 1:
            return ()
        return tuple(meaning.tag for meaning in meanings if meaning.tag != token.tag)

    def _unknown(self, word: str, previous: Token | None) -> Meaning:
        if word in self._lexicon.function_words or previous is None or previous.tag not in _TAGS_BEFORE_NOUN:
            return Meaning("UNKNOWN", word)
        singular = self._lexicon.singular_of(word)
        return Meaning("NOUN", singular, "unknown plural" if singular != word else "unknown")

    def _choose(
        self, meanings: tuple[Meaning, ...], previous: Token | None, words: tuple[str, ...], after: int
    ) -> Meaning:
        """Pick one of several classes by what stands before and after."""
        if len(meanings) == 1:
            return meanings[0]
        by_tag = {meaning.tag: meaning for meaning in meanings}
        for tag in self._preference(previous, self._next_tags(words, after)):
            if tag in by_tag:
                return by_tag[tag]
        return meanings[0]

    def _preference(self, previous: Token | None, following: frozenset[str]) -> tuple[str, ...]:
        before = previous.tag if previous else ""
        if before == "DISTANCE":
            return ("SIDE", "RELATION", "PLACE", "TO", "BETWEEN")
        if before in _TAGS_BEFORE_PERSON:
            return ("PERSON", "COUNT", "DEICTIC", "ADJECTIVE", "NOUN", "ONE")
        noun_follows = bool(following & {"NOUN", "ONE", "ADJECTIVE", "UNKNOWN_NOUN"})
        object_follows = noun_follows or bool(following & (PREMODIFIERS | {"PRONOUN"}))
        if before == "GOING":
            return ("PARTICIPLE", "RELATION", "SIDE", "PLACE")
        if before == "DEICTIC" and object_follows and not noun_follows:
            return _PREFERENCES["after", "object"]  # "this near that": no quality stands before another article
        unknown_noun = before == "NOUN" and previous is not None and previous.detail.startswith("unknown")
        situation = (
            "within"
            if before in PREMODIFIERS or unknown_noun
            else "begin"
            if before in _CLAUSE_BOUNDARY_TAGS
            else "after",
            "noun" if noun_follows else "object" if object_follows else "end",
        )
        if situation == ("after", "end") and before in ("NOUN", "ONE", "PRONOUN"):
            situation = ("object", "end")
        return _PREFERENCES[situation]

    def _next_tags(self, words: tuple[str, ...], after: int) -> frozenset[str]:
        if after >= len(words) or words[after] == ",":
            return frozenset()
        _, meanings = self._lexicon.longest_match(words, after)
        if meanings:
            return frozenset(meaning.tag for meaning in meanings)
        return frozenset() if words[after] in self._lexicon.function_words else frozenset({"UNKNOWN_NOUN"})


# After these "me" is the person who speaks, not who is to get something.
_TAGS_BEFORE_PERSON = frozenset({"RELATION", "TO", "SOURCE", "BETWEEN", "COMPARED"})
_CLAUSE_BOUNDARY_TAGS = frozenset({"", "AND", "CLAUSE_AND", "THEN"})
_PREFERRED_AT_END = ("VERB", "NOUN", "ONE", "DEICTIC", "COUNT", "PARTICLE", "SIDE", "ADJECTIVE")
_PREFERRED_AT_BEGINNING = ("VERB", "COUNT", "DEICTIC", "ADJECTIVE", "NOUN", "THEN", "RELATION")
_PREFERRED_WITHIN_PHRASE = ("NOUN", "ONE", "ADJECTIVE", "COMPARED", "RELATION")
# What stands before (within a phrase, at a clause's beginning, after an object, elsewhere) and what follows.
_PREFERENCES: dict[tuple[str, str], tuple[str, ...]] = {
    ("within", "noun"): ("COUNT", "ADJECTIVE", "NOUN", "ONE"),
    ("within", "object"): _PREFERRED_WITHIN_PHRASE,
    ("within", "end"): _PREFERRED_WITHIN_PHRASE,
    ("begin", "noun"): _PREFERRED_AT_BEGINNING,
    ("begin", "object"): _PREFERRED_AT_BEGINNING,
    ("begin", "end"): ("THEN", *_PREFERRED_AT_END),
    ("after", "noun"): ("COUNT", "DEICTIC", "ADJECTIVE", "COMPARED", "RELATION", "VERB", "RELATIVE", "NOUN"),
    ("after", "object"): ("RELATION", "SOURCE", "VERB", "COMPARED", "RELATIVE", "NOUN", "COUNT", "ADJECTIVE"),
    ("object", "end"): ("PARTICLE", "SIDE", "RELATIVE", "PARTICIPLE", "NOUN", "VERB", "RELATION"),
    ("after", "end"): _PREFERRED_AT_END,
}
