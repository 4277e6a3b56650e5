# SPDX-License-Identifier: Apache-2.0
"""Dialogue acts that an utterance opens with: stop, cancel, yes, no, a correction, a question."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass

from uncom_language.parser.lexical.lexicon import Lexicon, Phrase
from uncom_language.parser.lexical.tagger import remove_fillers
from uncom_language.parser.lexical.tokens import RawToken
from uncom_language.parser.options import PARSER
from uncom_language.types import Act

_ACT_OF_NAME = {"stop": Act.STOP, "cancel": Act.CANCEL, "yes": Act.YES, "no": Act.NO}
# Of several acts in one utterance the one that moves the robot least counts.
_LEAST_MOTION_FIRST = (Act.STOP, Act.CANCEL, Act.NO, Act.YES)


@dataclass(frozen=True, slots=True)
class Opening:
    """A dialogue act (or none), the words behind it, and whether these change what was said before."""

    act: Act | None = None
    rest: tuple[RawToken, ...] = ()
    amends: bool = False


class DialogueActReader:
    """Takes dialogue acts off an utterance."""

    def __init__(self, lexicon: Lexicon, parses: Callable[[tuple[RawToken, ...]], bool]) -> None:
        """Take the lexicon, and a function that tells whether words are a sentence of the grammar."""
        self._lexicon = lexicon
        self._parses = parses

    def read(self, items: tuple[RawToken, ...]) -> Opening:
        """Return what the utterance opens with."""
        words = _words(items)
        if words in self._lexicon.social and words not in self._lexicon.acts:
            return Opening(rest=items)
        kept = tuple(remove_fillers(items, self._lexicon))
        opening = self._split(kept)
        act = self._whole_act(words, _words(kept), _words(opening.rest))
        if act is None:
            act = self._act_of_non_sentence(items, words, opening)
        return opening if act is None else Opening(act)

    def _whole_act(self, words: Phrase, kept: Phrase, rest: Phrase) -> Act | None:
        """Return the act that all of an utterance is, with or without politeness and "actually"."""
        acts = self._lexicon.acts
        if words in acts:
            return _ACT_OF_NAME[acts[words]]
        several = self._only_acts(kept or words)
        if several:
            return next(act for act in _LEAST_MOTION_FIRST if act in several)
        return _ACT_OF_NAME[acts[rest]] if rest in acts else None

    def _act_of_non_sentence(self, items: tuple[RawToken, ...], words: Phrase, opening: Opening) -> Act | None:
        """Return stop or cancel, where one is said and the rest makes no sentence."""
        first, last = self._act_at_start(words), self._act_at_end(words)
        said = Act.STOP if Act.STOP in (first, last) else first if first is Act.CANCEL else None
        if said is None or self._parses(items):
            return None
        # "wait, no, the other one"
        amended = opening.amends and opening.act is Act.NO and last is not Act.STOP and self._parses(opening.rest)
        return None if amended else said

    def refusal(self, items: tuple[RawToken, ...]) -> str:
        """Return why words cannot be a command, by their beginning; empty if they may."""
        words = _words(items)
        if words in self._lexicon.social:
            return "that is no command for me"
        for start in dict.fromkeys((words, _words(tuple(remove_fillers(items, self._lexicon))))):
            if self._begins(start, self._lexicon.negations):
                return "I was told not to do something; I do nothing"
            if self._begins(start, self._lexicon.idioms, or_known=False):
                return "that is no command for an arm at a table"
            if self._begins(start, self._lexicon.questions):
                return "that is a question; I can only be told what to do"
        return ""

    def _begins(self, words: Phrase, phrases: Container[Phrase], *, or_known: bool = True) -> bool:
        """Whether words begin with one of the phrases, and with no longer one of a command."""
        length = _phrase_length(words, 0, phrases)
        if not length or not or_known:
            return bool(length)
        lexicon = self._lexicon
        return length >= max(lexicon.longest_match(words, 0)[0], _phrase_length(words, 0, lexicon.fillers))

    def _only_acts(self, words: Phrase) -> list[Act]:
        """Return the acts that make up all of the words; none if something else is among them."""
        acts: list[Act] = []
        while words:
            length = _phrase_length(words, 0, self._lexicon.acts)
            if not length:
                return []
            acts.append(_ACT_OF_NAME[self._lexicon.acts[words[:length]]])
            words = words[length:]
        return acts

    def _act_at_start(self, words: Phrase) -> Act | None:
        length = _phrase_length(words, 0, self._lexicon.acts)
        return _ACT_OF_NAME[self._lexicon.acts[words[:length]]] if length else None

    def _act_at_end(self, words: Phrase) -> Act | None:
        for start in range(max(0, len(words) - PARSER.max_act_words), len(words)):
            if words[start:] in self._lexicon.acts:
                return _ACT_OF_NAME[self._lexicon.acts[words[start:]]]
        return None

    def _split(self, items: tuple[RawToken, ...]) -> Opening:
        """Take "yes", "no", "I meant" off the front, "instead" off the end."""
        lexicon = self._lexicon
        act: Act | None = None
        amends = False
        while items:
            if items[0].is_break:
                items = items[1:]
                continue
            words = tuple(item.text for item in items)
            if _phrase_length(words, 0, lexicon.negations) and not _phrase_length(words, 0, lexicon.amends):
                break
            amending = _phrase_length(words, 0, lexicon.amends)
            yes = _phrase_length(words, 0, lexicon.acts) if not amends else 0
            yes = yes if yes and lexicon.acts[words[:yes]] in ("yes", "no") else 0
            length = max(amending, yes)
            if not length or length < lexicon.longest_match(words, 0)[0] or length == len(items):
                break
            kind = lexicon.acts.get(words[:length])
            act = _ACT_OF_NAME[kind] if kind in ("yes", "no") and act is None else act
            amends = amends or amending >= yes or kind == "no"
            items = items[length:]
        trimmed = self._strip_amending_end(items)
        return Opening(act, trimmed, amends or len(trimmed) < len(items))

    def _strip_amending_end(self, items: tuple[RawToken, ...]) -> tuple[RawToken, ...]:
        for length in range(PARSER.max_amending_words, 0, -1):
            if len(items) > length and tuple(item.text for item in items[-length:]) in self._lexicon.amends_after:
                return items[:-length]
        return items


def _words(items: tuple[RawToken, ...]) -> Phrase:
    return tuple(item.text for item in items if not item.is_break)


def _phrase_length(words: Phrase, start: int, phrases: Container[Phrase]) -> int:
    """Return how many words make the longest of the phrases; 0 if none."""
    return next(
        (
            n
            for n in range(min(len(words) - start, PARSER.max_marker_words), 0, -1)
            if words[start : start + n] in phrases
        ),
        0,
    )
