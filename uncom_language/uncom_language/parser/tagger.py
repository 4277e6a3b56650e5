# SPDX-License-Identifier: Apache-2.0
"""Words to classes of words: the terminals of the grammar. Ambiguous words are settled by their neighbours."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from uncom_language.parser.lexicon import Lexicon, Meaning

# What may stand before a noun within its phrase.
PREMODIFIERS = frozenset({"DETERMINER", "DEICTIC", "COUNT", "OTHER", "ADJECTIVE"})
# After these an unknown word is taken for a noun.
_EXPECT_NOUN = PREMODIFIERS | {
    "NOUN", "VERB", "RELATION", "TO", "SOURCE", "BETWEEN", "COMPARED", "OF", "AND", "PARTICLE", "RECIPIENT",
}  # fmt: skip
_PLACES = frozenset({"RELATION", "TO", "SOURCE", "BETWEEN", "SIDE", "PLACE", "RECIPIENT"})
_TOKEN = re.compile(r"[a-z0-9äöüßéè']+|[.;!?,:]", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Token:
    """A phrase with its class; first and last are word indices of the utterance."""

    tag: str
    value: str
    text: str
    first: int
    last: int
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Item:
    """One word of the input and its index; breaks (commas, full stops) keep the index of the word before."""

    text: str
    index: int
    is_break: bool = False


def split_text(text: str) -> tuple[Item, ...]:
    """Split a line into lower-case words and breaks."""
    items: list[Item] = []
    count = 0
    cleaned = text.lower().replace("\N{RIGHT SINGLE QUOTATION MARK}", "'").replace("-", " ").replace("_", " ")
    for match in _TOKEN.finditer(cleaned):
        piece = match.group().strip("'")
        if not piece:
            continue
        if piece in ".;!?,:":
            items.append(Item(piece, max(0, count - 1), is_break=True))
        else:
            items.append(Item(piece, count))
            count += 1
    return tuple(items)


def without_fillers(items: Sequence[Item], lexicon: Lexicon) -> list[Item]:
    """Remove hesitation and politeness, longest phrase first, unless a longer phrase of the lexicon covers them."""
    words_only = [item for item in items if (item.text,) not in lexicon.hesitations]
    kept: list[Item] = []
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


def _longest(words: tuple[str, ...], start: int, phrases: frozenset[tuple[str, ...]], limit: int) -> int:
    for length in range(min(limit, len(words) - start), 0, -1):
        if words[start : start + length] in phrases:
            return length
    return 0


class Tagger:
    """Gives every phrase of an utterance its class."""

    def __init__(self, lexicon: Lexicon) -> None:
        """Keep the lexicon."""
        self._lexicon = lexicon

    def tag(self, items: Sequence[Item]) -> list[Token]:
        """Return the tokens; a word that fits nowhere gets the class UNKNOWN."""
        words = tuple("," if item.is_break else item.text for item in items)
        tokens: list[Token] = []
        position = 0
        while position < len(items):
            if items[position].is_break:
                position += 1
                continue
            length, meanings = self._lexicon.longest_match(words, position)
            previous = tokens[-1] if tokens else None
            after = position + max(length, 1)
            meaning = (
                self._choose(meanings, previous, words, after) if meanings else self._unknown(words[position], previous)
            )
            length = max(length, 1)
            text = " ".join(words[position : position + length])
            first, last = items[position].index, items[position + length - 1].index
            tokens.append(Token(meaning.tag, meaning.value or text, text, first, last, meaning.detail))
            position += length
        return _settle_joins(tokens, {item.index for item in items if item.is_break and item.text != ","})

    def _unknown(self, word: str, previous: Token | None) -> Meaning:
        if word in self._lexicon.function_words or previous is None or previous.tag not in _EXPECT_NOUN:
            return Meaning("UNKNOWN", word)
        return Meaning("NOUN", word, "unknown")

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
        noun_follows = bool(following & {"NOUN", "ONE", "ADJECTIVE", "UNKNOWN_NOUN"})
        thing_follows = noun_follows or bool(following & (PREMODIFIERS | {"PRONOUN"}))
        if before == "GOING":
            return ("PARTICIPLE", "RELATION", "SIDE", "PLACE")
        unknown_noun = before == "NOUN" and previous is not None and previous.detail == "unknown"
        situation = (
            "within" if before in PREMODIFIERS or unknown_noun else "begin" if before in _BEGINNINGS else "after",
            "noun" if noun_follows else "thing" if thing_follows else "end",
        )
        if situation == ("after", "end") and before in ("NOUN", "ONE", "PRONOUN"):
            situation = ("thing", "end")
        return _PREFERENCES[situation]

    def _next_tags(self, words: tuple[str, ...], after: int) -> frozenset[str]:
        if after >= len(words) or words[after] == ",":
            return frozenset()
        _, meanings = self._lexicon.longest_match(words, after)
        if meanings:
            return frozenset(meaning.tag for meaning in meanings)
        return frozenset() if words[after] in self._lexicon.function_words else frozenset({"UNKNOWN_NOUN"})


_BEGINNINGS = frozenset({"", "AND", "CLAUSE_AND", "THEN"})
_LAST = ("VERB", "NOUN", "ONE", "DEICTIC", "COUNT", "PARTICLE", "SIDE", "ADJECTIVE")
_FIRST = ("VERB", "COUNT", "DEICTIC", "ADJECTIVE", "NOUN", "THEN", "RELATION")
_ENDING = ("NOUN", "ONE", "ADJECTIVE", "COMPARED", "RELATION")
# What stands before (within a phrase, at a clause's beginning, after a thing, elsewhere) and what follows.
_PREFERENCES: dict[tuple[str, str], tuple[str, ...]] = {
    ("within", "noun"): ("COUNT", "ADJECTIVE", "NOUN", "ONE"),
    ("within", "thing"): _ENDING,
    ("within", "end"): _ENDING,
    ("begin", "noun"): _FIRST,
    ("begin", "thing"): _FIRST,
    ("begin", "end"): ("THEN", *_LAST),
    ("after", "noun"): ("COUNT", "DEICTIC", "ADJECTIVE", "COMPARED", "RELATION", "VERB", "RELATIVE", "NOUN"),
    ("after", "thing"): ("RELATION", "SOURCE", "VERB", "COMPARED", "RELATIVE", "NOUN", "COUNT", "ADJECTIVE"),
    ("thing", "end"): ("PARTICLE", "SIDE", "RELATIVE", "PARTICIPLE", "NOUN", "VERB", "RELATION"),
    ("after", "end"): _LAST,
}


def _settle_joins(tokens: list[Token], stops: set[int]) -> list[Token]:
    """Tell an "and" between clauses from one between things; a full stop joins clauses."""
    settled: list[Token] = []
    between_open = place_seen = False
    for position, token in enumerate(tokens):
        tag = token.tag
        if (
            settled
            and settled[-1].last in stops
            and tag not in ("AND", "THEN")
            and settled[-1].tag not in ("AND", "THEN", "CLAUSE_AND")
        ):
            settled.append(Token("THEN", ".", ".", settled[-1].last, settled[-1].last))
            between_open = place_seen = False
        if tag == "AND":
            tag, between_open = _join_tag(tokens, position, between_open, place_seen), False
        if tag in ("CLAUSE_AND", "THEN"):
            between_open = place_seen = False
        elif tag == "BETWEEN":
            between_open = place_seen = True
        elif tag in _PLACES:
            place_seen = True
        settled.append(Token(tag, token.value, token.text, token.first, token.last, token.detail))
    while settled and settled[-1].tag in ("CLAUSE_AND", "THEN", "AND"):
        settled.pop()
    return settled


def _join_tag(tokens: list[Token], position: int, between_open: bool, place_seen: bool) -> str:
    following = tokens[position + 1].tag if position + 1 < len(tokens) else ""
    if following in ("VERB", "THEN", "") or following in _PLACES:
        return "CLAUSE_AND"
    if between_open:
        return "AND"
    return "CLAUSE_AND" if place_seen else "AND"
