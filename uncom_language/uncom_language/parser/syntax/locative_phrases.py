# SPDX-License-Identifier: Apache-2.0
"""Locating, comparing and excluding phrases, and how they hang on objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from uncom_language.parser.lexical.tokens import Token
from uncom_language.types import Reference, Span

# Locating relations in which an object lies in or on another; in a chain of phrases these are where objects are put.
SUPPORTING = frozenset({"in", "on"})
# The side of "the cup on the left" as a quality, and as the side that "the second from the left" is counted from.
_SIDES = {"left_of": "left", "right_of": "right", "in_front_of": "front", "behind": "back", "between": "middle"}


@dataclass(frozen=True, slots=True)
class LocativePhrase:
    """One phrase: "in the bowl", "between A and B", "here", "on the left", "similar to this", "to me", "not red"."""

    kind: str  # located, between, side, here, recipient, compared, likeness, pointed, excepted, quality, moved
    relation: str
    tokens: tuple[Token, ...]
    references: tuple[Reference, ...] = ()
    text: str = ""
    restrictive: bool = False  # "the cup that is ...": tells which object, never where to
    directed: bool = False  # "into", "onto", "to": where to, never which object
    toward: bool = False  # "to the left of": rather where to
    distance_m: float = 0.0


@dataclass(frozen=True, slots=True)
class WordTiming:
    """Start and end [s] of every word of the utterance."""

    spans: tuple[Span, ...]

    def of(self, tokens: Sequence[Token]) -> Span:
        """Return the span from the first to the last word of tokens."""
        first = min(token.first for token in tokens)
        last = max(token.last for token in tokens)
        return Span(self.spans[first].start_s, self.spans[last].end_s)


def attach_phrases(reference: Reference, places: Sequence[LocativePhrase], timing: WordTiming) -> Reference:
    """Hang phrases on an object; locating ones behind another phrase hang on the object in that one."""
    result = reference
    if not places:
        return result
    first, rest = places[0], tuple(places[1:])
    if first.kind in ("located", "between") and first.references and not result.anchor:
        *others, last = first.references
        anchor = attach_phrases(last, rest, timing)
        if others:  # between A and B: B hangs on A
            anchor = replace(others[0], anchor=anchor, anchor_relation="and")
        return replace(result, anchor_relation=first.relation, anchor=anchor)
    if first.kind == "compared" and first.relation == "with":
        text = " ".join(token.text for token in first.tokens)
        result = replace(result, modifiers=(*result.modifiers, text))
        if rest and rest[0].references and rest[0].references[0].anaphoric:
            rest = rest[1:]  # "the plate with the lemon on it"
    elif first.kind in ("compared", "likeness"):
        compared = attach_phrases(first.references[-1], rest, timing)
        comparison = first.relation or result.comparison or "similar"
        return replace(result, comparison=comparison, compared_to=compared)
    elif first.kind == "excepted":
        result = _exclude(result, first)
    elif first.kind in ("here", "pointed"):
        word = first.relation if first.kind == "here" else "this"
        if not result.deictic:
            result = replace(result, deictic=word, deictic_span=timing.of(first.tokens))
    elif first.kind == "side":
        side = _SIDES.get(first.relation, first.text)
        counted = result.ordinal and not result.ordinal_side
        result = replace(
            result,
            ordinal_side=side if counted else result.ordinal_side,
            modifiers=result.modifiers if counted else (*result.modifiers, side),
        )
    elif first.kind == "quality":
        result = replace(result, text=f"{first.text} {result.text}", modifiers=(first.text, *result.modifiers))
    return attach_phrases(_extend_span(result, first, timing), rest, timing)


def _exclude(reference: Reference, place: LocativePhrase) -> Reference:
    """Return the object with what it must not be."""
    if not place.references:
        return replace(reference, excluded_modifiers=(*reference.excluded_modifiers, place.text))
    (excluded,) = place.references
    words = [*excluded.modifiers, excluded.head] if excluded.concrete else list(excluded.modifiers)
    if excluded.head in words[:-1]:
        words.pop()
    result = replace(reference, excluded_modifiers=(*reference.excluded_modifiers, *words))
    bare = excluded.head in excluded.modifiers and excluded.text == " ".join(excluded.modifiers)
    if bare or reference.comparison:
        return result
    return replace(result, comparison="except", compared_to=excluded)


def _extend_span(reference: Reference, place: LocativePhrase, timing: WordTiming) -> Reference:
    """Let the object's span run to the end of a phrase that belongs to it and holds no object of its own."""
    if place.references:
        return reference
    return replace(
        reference, span=Span(reference.span.start_s, max(reference.span.end_s, timing.of(place.tokens).end_s))
    )
