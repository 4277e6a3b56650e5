# SPDX-License-Identifier: Apache-2.0
"""Phrases for objects and places, from the parse tree to values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, cast

import lark

from uncom_language.parser.lexical.lexicon import Lexicon
from uncom_language.parser.lexical.tokens import Token
from uncom_language.parser.options import PARSER
from uncom_language.parser.syntax.grammar import NotInGrammarError, Tree, children
from uncom_language.parser.syntax.locative_phrases import LocativePhrase, WordTiming
from uncom_language.types import Reference

_DETERMINER_TAGS = frozenset({"DETERMINER", "DEICTIC", "SAME"})
_DESCRIPTIVE_TAGS = frozenset({"OTHER", "ADJECTIVE", "NOUN", "ONE", "PERSON"})


def tokens_of(tree: Tree | lark.Token) -> tuple[Token, ...]:
    """Return all tokens under a tree, in order."""
    if isinstance(tree, lark.Token):
        return (_token(tree),)
    return tuple(_token(leaf) for leaf in cast(Any, tree).scan_values(lambda _: True))


def _token(leaf: lark.Token) -> Token:
    value = leaf.value
    if not isinstance(value, Token):
        raise TypeError(f"terminal {leaf!r} carries no token")
    return value


def _first(tokens: Sequence[Token], tag: str) -> Token | None:
    return next((token for token in tokens if token.tag == tag), None)


class ReferenceBuilder:
    """Builds references and places of one utterance."""

    def __init__(self, lexicon: Lexicon, timing: WordTiming) -> None:
        """Take the words of the language and the times of those that were said.

        References are numbered through the whole utterance.
        """
        self._lexicon = lexicon
        self._timing = timing
        self._next_position = 0

    def _take_position(self) -> int:
        self._next_position += 1
        return self._next_position - 1

    def reference(self, tree: Tree) -> Reference:
        """Read a `object` of the grammar.

        Raises:
            NotInGrammarError: a determiner alone, or one behind an adjective ("open the door").
        """
        inner = next((part for part in children(tree) if isinstance(part, lark.Tree) and part.data == "of"), None)
        if inner is not None:
            return self._partitive(tree, inner)
        tokens = tokens_of(tree)
        order = self._take_position()
        head, nouns, of_phrase = self._noun_group(tree)
        flat = tokens if of_phrase is None else tokens[: len(tokens) - len(of_phrase)]
        _check_order(flat)
        qualities = tuple(token for token in flat if token.tag == "ADJECTIVE")
        deictic, pronoun, same = _first(flat, "DEICTIC"), _first(flat, "PRONOUN"), _first(flat, "SAME")
        ordinal = next((token for token in qualities if token.value == "ordinal"), None)
        named = head is not None and head.tag == "NOUN" and head.value not in self._lexicon.generic
        concrete = named and head is not None and head.value not in self._lexicon.place_nouns
        tail = f" {' '.join(token.text for token in of_phrase)}" if of_phrase else ""
        modifiers = (*(token for token in qualities if token is not ordinal), *nouns[:-1])
        return Reference(
            text=self._text(flat, deictic, pronoun, concrete=concrete) + tail,
            head=_head_word(head, pronoun, deictic, qualities, flat),
            span=self._timing.of(tokens),
            modifiers=tuple(token.text for token in modifiers) + ((tail.strip(),) if tail else ()),
            concrete=concrete,
            deictic=deictic.value if deictic else "",
            deictic_span=self._timing.of([deictic]) if deictic else None,
            anaphoric=pronoun is not None,
            other=any(token.tag == "OTHER" for token in flat),
            quantity=self._quantity(flat, head, deictic, pronoun),
            order=order,
            ordinal=int(ordinal.detail) if ordinal else 0,
            comparison=same.value if same else "",
        )

    def _partitive(self, tree: Tree, inner: Tree) -> Reference:
        """Read "the smallest of the apples": an apple, of which one is meant."""
        group = self.reference(next(part for part in children(inner) if isinstance(part, lark.Tree)))
        tokens = tokens_of(tree)
        flat = tokens[: len(tokens) - len(tokens_of(inner))]
        ordinal = next((token for token in flat if token.value == "ordinal"), None)
        qualities = tuple(token.text for token in flat if token.tag == "ADJECTIVE" and token is not ordinal)
        return replace(
            group,
            text=" ".join(token.text for token in tokens if token is not tokens[0] or token.tag != "DETERMINER"),
            span=self._timing.of(tokens),
            modifiers=(*qualities, *group.modifiers),
            ordinal=int(ordinal.detail) if ordinal else 0,
            quantity=1,
        )

    def _text(self, tokens: Sequence[Token], deictic: Token | None, pronoun: Token | None, *, concrete: bool) -> str:
        """Return the words without determiner and count; a pointing word stays where nothing is named."""
        if pronoun is not None:
            return pronoun.detail
        spoken = [token for token in tokens if token.tag in _DESCRIPTIVE_TAGS]
        words = [
            token.text for token in spoken if token.tag != "OTHER" or token.text not in self._lexicon.other_determiners
        ]
        if deictic is not None and not concrete:
            words.insert(0, deictic.text)
        return " ".join(words) or " ".join(token.text for token in tokens)

    def _noun_group(self, tree: Tree) -> tuple[Token | None, tuple[Token, ...], tuple[Token, ...] | None]:
        """Return the head, the noun tokens, and the tokens of an "of ..." phrase."""
        group = next(
            (child for child in children(tree) if isinstance(child, lark.Tree) and child.data == "nouns"), None
        )
        if group is None:
            return None, (), None
        parts = children(group)
        nouns = tuple(_token(part) for part in parts if isinstance(part, lark.Token) and part.type in ("NOUN", "ONE"))
        head = nouns[self._lexicon.head_index]
        if self._lexicon.head_index == 0:  # the last noun is the head unless a language says otherwise
            nouns = (*nouns[1:], head)
        inner = next((part for part in parts if isinstance(part, lark.Tree)), None)
        if inner is None:
            return head, nouns, None
        of_token = next(_token(part) for part in parts if isinstance(part, lark.Token) and part.type == "OF")
        return head, nouns, (of_token, *tokens_of(inner))

    def _quantity(
        self, tokens: Sequence[Token], head: Token | None, deictic: Token | None, pronoun: Token | None
    ) -> int:
        """Return how many are meant; 0 is all of them."""
        counts = [int(token.value) for token in tokens if token.tag == "COUNT"]
        if counts:
            return min(counts[0], PARSER.max_quantity)
        if pronoun is not None:
            return int(pronoun.value)
        plural = head is not None and (head.detail.endswith("plural") or head.text in self._lexicon.many)
        plural = plural or (deictic is not None and deictic.value in ("these", "those"))
        plural = plural or (head is None and any(token.text in self._lexicon.many for token in tokens))
        return 0 if plural else 1

    def places(self, tree: Tree) -> tuple[LocativePhrase, ...]:
        """Read a chain of locating phrases."""
        return tuple(self.place(child) for child in children(tree) if isinstance(child, lark.Tree))

    def place(self, tree: Tree) -> LocativePhrase:
        """Read one locating, comparing or excluding phrase."""
        inner = [child for child in children(tree) if isinstance(child, lark.Tree)]
        tokens = tokens_of(tree)
        if tree.data == "relative_clause":
            if inner:
                return replace(self.place(inner[0]), restrictive=True)
            return LocativePhrase(
                "quality", "", tokens, text=" ".join(token.text for token in tokens[1:]), restrictive=True
            )
        if tree.data == "moved":
            made = replace(self.place(inner[0]), tokens=tokens) if inner else LocativePhrase("moved", "", tokens)
            return replace(made, distance_m=float(tokens[0].value))
        if tree.data in ("excepted", "negated_relative_clause"):
            if inner[0].data != "noun_phrase" and tokens[0].text in self._lexicon.instead:
                return self.place(inner[0])  # "not on the plate but in the bowl"
            references = (self.reference(inner[0]),) if inner[0].data == "noun_phrase" else ()
            text = " ".join(token.text for token in tokens[1:])
            return LocativePhrase("excepted", "", tokens, references, text, restrictive=True)
        return self._marked_phrase(tree, tokens)

    def _marked_phrase(self, tree: Tree, tokens: tuple[Token, ...]) -> LocativePhrase:
        # The marking word comes first or last, as the language has it.
        mark = next(_token(child) for child in children(tree) if isinstance(child, lark.Token))
        references = tuple(
            self.reference(child)
            for child in children(tree)
            if isinstance(child, lark.Tree) and child.data == "noun_phrase"
        )
        kind, relation = str(tree.data), mark.value
        if kind == "between":
            relation = "between"
        if kind == "likeness":
            references = (self._pointing_reference(mark),)
        if mark.tag == "TO" or relation == "from":
            relation = self._relation_by_class(references[0])
        return LocativePhrase(
            kind=kind,
            relation="" if mark.tag == "AS" else relation,
            tokens=tokens,
            references=references,
            text=mark.text,
            restrictive=kind in ("compared", "likeness", "pointed") or mark.tag == "SOURCE",
            directed=mark.tag == "TO" or mark.text in self._lexicon.directed,
            toward=mark.text in self._lexicon.toward,
        )

    def _pointing_reference(self, token: Token) -> Reference:
        """Return the pointing word within "of this colour" as an object of its own."""
        span = self._timing.of([token])
        word = token.detail
        return Reference(
            word,
            word,
            span,
            concrete=False,
            deictic=self._deictic(word),
            deictic_span=span,
            order=self._take_position(),
        )

    def _deictic(self, word: str) -> str:
        return str(self._lexicon.raw["deictics"].get(word, word))

    def _relation_by_class(self, reference: Reference) -> str:
        """Read "to" and "from": into a container, onto a surface, near anything else."""
        kind = self._lexicon.noun_class.get(reference.head, "")
        return {"container": "in", "surface": "on", "kitchenware": "in"}.get(kind, "near")

    def area(self, place: LocativePhrase) -> Reference:
        """Return "here" or "there" as a target of its own."""
        span = self._timing.of([token for token in place.tokens if token.tag != "DISTANCE"])
        word = str(self._lexicon.raw["places"][place.relation][0])
        return Reference(
            word, word, span, concrete=False, deictic=place.relation, deictic_span=span, order=self._take_position()
        )

    def held(self, tokens: Sequence[Token]) -> Reference:
        """Return what the hand holds: "let go"."""
        word = next(iter(self._lexicon.raw["pronouns"]))
        return Reference(
            word, word, self._timing.of(tokens), concrete=False, anaphoric=True, order=self._take_position()
        )

    def unnamed(self, place: LocativePhrase) -> Reference:
        """Return the unnamed object that a phrase alone speaks of: "not the red one"."""
        word = self._lexicon.one
        return Reference(word, word, self._timing.of(place.tokens), concrete=False, order=self._take_position())


def _check_order(tokens: Sequence[Token]) -> None:
    """Reject a determiner with nothing behind it, or behind an adjective."""
    if all(token.tag == "DETERMINER" for token in tokens):
        raise NotInGrammarError(tokens[-1], ("NOUN",))
    for before, token in pairwise(tokens):
        if token.tag in _DETERMINER_TAGS and before.tag in ("ADJECTIVE", "NOUN", "ONE"):
            raise NotInGrammarError(token, ("NOUN",))


def _head_word(
    head: Token | None,
    pronoun: Token | None,
    deictic: Token | None,
    qualities: Sequence[Token],
    tokens: Sequence[Token],
) -> str:
    if pronoun is not None:
        return pronoun.detail
    for token in (head, deictic):
        if token is not None:
            return token.value if token.tag in ("NOUN", "DEICTIC") else token.text
    return qualities[-1].text if qualities else tokens[-1].text
