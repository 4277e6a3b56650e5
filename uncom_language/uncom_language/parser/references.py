# SPDX-License-Identifier: Apache-2.0
"""Phrases for things and places, from the parse tree to values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import lark

from uncom_language.parser.grammar import NotInGrammarError, Tree, children
from uncom_language.parser.lexicon import Lexicon
from uncom_language.parser.tagger import Token
from uncom_language.types import Reference, Span

# Locating relations in which a thing lies in or on another; in a chain of phrases these are where things are put.
SUPPORTING = frozenset({"in", "on"})


# "another cup" is a determiner, "the other cup" a quality.
_OTHER_DETERMINERS = frozenset({"another", "different", "rest of"})


@dataclass(frozen=True, slots=True)
class Place:
    """One locating phrase: "in the bowl", "between A and B", "here", "on the left", "similar to this", "to me"."""

    kind: str  # located, between, side, here, recipient, compared, pointed
    relation: str
    tokens: tuple[Token, ...]
    things: tuple[Reference, ...] = ()
    text: str = ""
    restrictive: bool = False  # "the cup that is ...": tells which thing, never where to
    directed: bool = False  # "into", "onto", "to": where to, never which thing


@dataclass(frozen=True, slots=True)
class Timing:
    """Start and end [s] of every word of the utterance."""

    spans: tuple[Span, ...]

    def of(self, tokens: Sequence[Token]) -> Span:
        """Return the span from the first to the last word of tokens."""
        first = min(token.first for token in tokens)
        last = max(token.last for token in tokens)
        return Span(self.spans[first].start_s, self.spans[last].end_s)


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


class ReferenceBuilder:
    """Builds references and places of one utterance."""

    def __init__(self, lexicon: Lexicon, timing: Timing) -> None:
        """Keep the words' meanings and times; the order counts phrases through the whole utterance."""
        self._lexicon = lexicon
        self._timing = timing
        self._next_order = 0

    def thing(self, tree: Tree) -> Reference:
        """Read a `thing` of the grammar."""
        tokens = tokens_of(tree)
        if all(token.tag == "DETERMINER" for token in tokens):
            raise NotInGrammarError(tokens[-1], ("NOUN",))
        order = self._next_order
        self._next_order += 1
        head, nouns, of_thing = self._nouns(tree)
        flat = tokens if of_thing is None else tokens[: len(tokens) - len(of_thing)]
        qualities = tuple(token for token in flat if token.tag == "ADJECTIVE")
        deictic = next((token for token in flat if token.tag == "DEICTIC"), None)
        pronoun = next((token for token in flat if token.tag == "PRONOUN"), None)
        named = head is not None and head.tag == "NOUN" and head.value not in self._lexicon.generic
        concrete = named and head is not None and head.value not in self._lexicon.place_nouns
        modifiers = (*qualities, *nouns[:-1])
        spoken = [token for token in flat if token.tag in ("OTHER", "ADJECTIVE", "NOUN", "ONE", "PRONOUN")]
        spoken = [token for token in spoken if token.tag != "OTHER" or token.text not in _OTHER_DETERMINERS]
        words = [token.text for token in spoken]
        if deictic is not None and not concrete:
            words.insert(0, deictic.value)
        tail = f" {' '.join(token.text for token in of_thing)}" if of_thing else ""
        return Reference(
            text=(" ".join(words) or " ".join(token.text for token in flat)) + tail,
            head=self._head_word(head, pronoun, deictic, qualities, flat),
            span=self._timing.of(tokens),
            modifiers=tuple(token.text for token in modifiers) + ((tail.strip(),) if tail else ()),
            concrete=concrete,
            deictic=deictic.value if deictic else "",
            deictic_span=self._timing.of([deictic]) if deictic else None,
            anaphoric=pronoun is not None,
            other=any(token.tag == "OTHER" for token in flat),
            quantity=self._quantity(flat, head, deictic, pronoun),
            order=order,
        )

    def _nouns(self, tree: Tree) -> tuple[Token | None, tuple[Token, ...], tuple[Token, ...] | None]:
        """Return the head, the noun tokens, and the tokens of an "of ..." phrase."""
        group = next(
            (child for child in children(tree) if isinstance(child, lark.Tree) and child.data == "nouns"), None
        )
        if group is None:
            return None, (), None
        nouns = tuple(
            _token(child)
            for child in children(group)
            if isinstance(child, lark.Token) and child.type in ("NOUN", "ONE")
        )
        inner = next((child for child in children(group) if isinstance(child, lark.Tree)), None)
        if inner is None:
            return nouns[-1], nouns, None
        of_token = next(
            _token(child) for child in children(group) if isinstance(child, lark.Token) and child.type == "OF"
        )
        return nouns[-1], nouns, (of_token, *tokens_of(inner))

    @staticmethod
    def _head_word(
        head: Token | None,
        pronoun: Token | None,
        deictic: Token | None,
        qualities: tuple[Token, ...],
        tokens: tuple[Token, ...],
    ) -> str:
        for token in (head, pronoun, deictic):
            if token is not None:
                return token.value if token.tag in ("NOUN", "DEICTIC") else token.text
        return qualities[-1].text if qualities else tokens[-1].text

    def _quantity(
        self, tokens: tuple[Token, ...], head: Token | None, deictic: Token | None, pronoun: Token | None
    ) -> int:
        """Return how many are meant; 0 is all of them."""
        counts = [int(token.value) for token in tokens if token.tag == "COUNT"]
        if counts:
            return counts[0]
        if pronoun is not None:
            return int(pronoun.value)
        plural = head is not None and (head.detail == "plural" or head.text == "ones")
        plural = plural or (deictic is not None and deictic.value in ("these", "those"))
        plural = plural or (head is None and any(token.text == "others" for token in tokens))
        return 0 if plural else 1

    def places(self, tree: Tree) -> tuple[Place, ...]:
        """Read a chain of locating phrases."""
        return tuple(self.place(child) for child in children(tree) if isinstance(child, lark.Tree))

    def place(self, tree: Tree) -> Place:
        """Read one locating phrase."""
        if tree.data == "which":
            inner = [child for child in children(tree) if isinstance(child, lark.Tree)]
            if inner:
                return replace(self.place(inner[0]), restrictive=True)
            tokens = tokens_of(tree)
            return Place("quality", "", tokens, text=" ".join(token.text for token in tokens[1:]), restrictive=True)
        leaves = [_token(child) for child in children(tree) if isinstance(child, lark.Token)]
        things = tuple(
            self.thing(child) for child in children(tree) if isinstance(child, lark.Tree) and child.data == "thing"
        )
        first = leaves[0]
        kind, relation = str(tree.data), first.value
        if kind == "between":
            relation = "between"
        if first.tag == "TO" or relation == "from":
            relation = self._by_class(things[0])
        return Place(
            kind=kind,
            relation=relation,
            tokens=tokens_of(tree),
            things=things,
            text=first.text,
            restrictive=kind in ("compared", "pointed") or first.tag == "SOURCE",
            directed=first.tag == "TO" or first.text in ("into", "onto", "in to", "on to"),
        )

    def _by_class(self, thing: Reference) -> str:
        """Read "to" and "from": into a container, onto a surface, near anything else."""
        kind = self._lexicon.noun_class.get(thing.head, "")
        return {"container": "in", "surface": "on", "kitchenware": "in"}.get(kind, "near")

    def area(self, place: Place) -> Reference:
        """Return "here" or "there" as a target of its own."""
        token = place.tokens[0]
        order = self._next_order
        self._next_order += 1
        span = self._timing.of(place.tokens)
        return Reference(
            text=token.value,
            head=token.value,
            span=span,
            concrete=False,
            deictic=token.value,
            deictic_span=span,
            order=order,
        )


def attach(thing: Reference, places: Sequence[Place], timing: Timing) -> Reference:
    """Hang locating phrases on a thing; the later ones hang on the things of the earlier ones."""
    result = thing
    if not places:
        return result
    first, rest = places[0], tuple(places[1:])
    if first.kind in ("located", "between", "compared") and first.things:
        if first.kind == "compared" and first.relation == "with":
            text = " ".join(token.text for token in first.tokens)
            result = replace(result, modifiers=(*result.modifiers, text))
        else:
            *others, last = first.things
            anchor = attach(last, rest, timing)
            if others:  # between A and B: B hangs on A
                anchor = replace(others[0], anchor=anchor, anchor_relation="and")
            return replace(_widened(result, first, timing), anchor_relation=first.relation, anchor=anchor)
    elif first.kind in ("here", "pointed"):
        span = timing.of(first.tokens)
        word = first.relation if first.kind == "here" else "this"
        if not result.deictic:
            result = replace(result, deictic=word, deictic_span=span)
    elif first.kind == "side":
        text = " ".join(token.text for token in first.tokens)
        result = replace(result, text=f"{result.text} {text}", modifiers=(*result.modifiers, text))
    elif first.kind == "quality":
        result = replace(result, modifiers=(*result.modifiers, first.text))
    return attach(_widened(result, first, timing), rest, timing)


def _widened(thing: Reference, place: Place, timing: Timing) -> Reference:
    """Let the thing's span run to the end of a phrase that belongs to it and holds no thing of its own."""
    if place.things:
        return thing
    return replace(thing, span=Span(thing.span.start_s, max(thing.span.end_s, timing.of(place.tokens).end_s)))
