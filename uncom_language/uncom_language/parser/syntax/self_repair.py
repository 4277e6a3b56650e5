# SPDX-License-Identifier: Apache-2.0
"""Self-correction: "put the red cup, no wait, the blue one in the bowl"."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from uncom_language.parser.lexical.lexicon import Lexicon
from uncom_language.parser.lexical.tagger import Tagger, remove_fillers
from uncom_language.parser.lexical.tokens import OBJECT_TAGS, RawToken, Token
from uncom_language.parser.options import PARSER
from uncom_language.parser.syntax.grammar import NotInGrammarError, parse_tokens

_PLACE_START_TAGS = frozenset({"RELATION", "TO", "BETWEEN", "PLACE", "SIDE", "SOURCE"})


@dataclass(frozen=True, slots=True)
class RepairedUtterance:
    """The words that count, and what was left out."""

    items: tuple[RawToken, ...]
    notes: tuple[str, ...] = ()


def apply_self_repairs(items: tuple[RawToken, ...], lexicon: Lexicon, tagger: Tagger) -> RepairedUtterance:
    """Apply the corrections of an utterance, first to last; without any it is returned as it is."""
    notes: list[str] = []
    for _ in range(PARSER.max_self_repairs):
        found = _find_repair_marker(items, lexicon)
        if found is None:
            break
        start, end = found
        before, after = items[:start], _remove_commas(items[end:])
        if not after or not before:
            items = before or after
            continue
        corrected = next(_replacements(_strip_final_breaks(before), after, lexicon, tagger), None)
        if corrected is None:
            items = after if _is_clause(after, lexicon, tagger) else (*before, *after)
            if items is not after:
                return RepairedUtterance(items, tuple(notes))
        else:
            items = corrected
        notes.append(f"corrected by the speaker after {' '.join(item.text for item in before)!r}")
    return RepairedUtterance(items, tuple(notes))


def _find_repair_marker(items: tuple[RawToken, ...], lexicon: Lexicon) -> tuple[int, int] | None:
    """Return where the first correction marker starts and ends; a leading one is none."""
    words = tuple(item.text for item in items)
    position = 0
    while position < len(items):
        length = next(
            (
                n
                for n in range(min(lexicon.longest, len(words) - position), 0, -1)
                if words[position : position + n] in lexicon.repairs
            ),
            0,
        )
        if length:
            end = position + length
            while True:  # "no, wait, sorry": one marker
                while end < len(items) and items[end].is_break:
                    end += 1
                more = next(
                    (
                        n
                        for n in range(min(lexicon.longest, len(words) - end), 0, -1)
                        if words[end : end + n] in lexicon.repairs
                    ),
                    0,
                )
                if not more:
                    return position, end
                end += more
        position += 1
    return None


def _strip_final_breaks(items: tuple[RawToken, ...]) -> tuple[RawToken, ...]:
    """Drop breaks at the end."""
    end = len(items)
    while end and items[end - 1].is_break:
        end -= 1
    return items[:end]


def _remove_commas(items: tuple[RawToken, ...]) -> tuple[RawToken, ...]:
    return tuple(item for item in items if item.text != ",")


def _replacements(
    before: tuple[RawToken, ...], after: tuple[RawToken, ...], lexicon: Lexicon, tagger: Tagger
) -> Iterator[tuple[RawToken, ...]]:
    """Yield sentences in which the correction replaces a phrase of its own kind; the most likely one first."""
    right = tagger.tag(remove_fillers(after, lexicon))
    left = tagger.tag(remove_fillers(before, lexicon))
    if not right or not left:
        return
    if right[0].tag == "VERB":
        yield from _replace_clause(before, after, left, lexicon, tagger)
        return
    kinds = _PLACE_START_TAGS if right[0].tag in _PLACE_START_TAGS else OBJECT_TAGS
    starts = [
        position
        for position, token in enumerate(left)
        if token.tag in kinds
        and (kinds is _PLACE_START_TAGS or position == 0 or left[position - 1].tag not in OBJECT_TAGS)
    ]
    starts.sort(key=lambda position: (_contrast_score(left, position, right), position), reverse=True)
    for position in starts:
        head = tuple(item for item in before if item.index < left[position].first)
        yield from _replace_phrase(head, before, after, left, position, lexicon, tagger)


def _replace_phrase(
    head: tuple[RawToken, ...],
    before: tuple[RawToken, ...],
    after: tuple[RawToken, ...],
    left: list[Token],
    position: int,
    lexicon: Lexicon,
    tagger: Tagger,
) -> Iterator[tuple[RawToken, ...]]:
    """Yield the sentence with the phrase at `position` replaced; words after that phrase stay if they still fit."""
    end = position
    while end < len(left) and left[end].tag in OBJECT_TAGS | (_PLACE_START_TAGS if end == position else frozenset()):
        end += 1
    tail = tuple(item for item in before if end < len(left) and item.index >= left[end].first)
    for attempt in ((*head, *after, *tail), (*head, *after)) if tail else ((*head, *after),):
        if _is_sentence(attempt, lexicon, tagger):
            yield attempt


def _replace_clause(
    before: tuple[RawToken, ...], after: tuple[RawToken, ...], left: list[Token], lexicon: Lexicon, tagger: Tagger
) -> Iterator[tuple[RawToken, ...]]:
    """Yield the sentence with its last clause said anew."""
    verbs = [token for token in left if token.tag == "VERB"]
    for verb in reversed(verbs):
        attempt = (*(item for item in before if item.index < verb.first), *after)
        if _is_sentence(attempt, lexicon, tagger):
            yield attempt


def _contrast_score(left: list[Token], position: int, right: list[Token]) -> int:
    """Return how well a correction contrasts with a phrase: qualities of the same sort, or a noun for a noun."""
    score = 0
    phrase: list[Token] = []
    for token in left[position:]:
        if token.tag not in OBJECT_TAGS:
            break
        phrase.append(token)
    for new in right:
        if new.tag not in OBJECT_TAGS:
            break
        same = [old for old in phrase if old.tag == new.tag]
        if new.tag == "ADJECTIVE" and any(old.value == new.value for old in same):
            score += 2
        if new.tag == "NOUN" and any(old.text == new.text for old in same):
            score += 1
    return score


def _is_sentence(items: tuple[RawToken, ...], lexicon: Lexicon, tagger: Tagger) -> bool:
    tokens = tagger.tag(remove_fillers(items, lexicon))
    if not tokens:
        return False
    try:
        parse_tokens(tokens, lexicon.language)
    except NotInGrammarError:
        return False
    return True


def _is_clause(items: tuple[RawToken, ...], lexicon: Lexicon, tagger: Tagger) -> bool:
    """Whether words are a command by themselves, verb included."""
    tokens = tagger.tag(remove_fillers(items, lexicon))
    return any(token.tag == "VERB" for token in tokens) and _is_sentence(items, lexicon, tagger)
