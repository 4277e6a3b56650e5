# SPDX-License-Identifier: Apache-2.0
"""Finds the words of a sentence that name the object and the place, so that the hand moves with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_PLACES = _words("here there")
_DETERMINERS = _words("the a an my your our his her their some one another other this that these those")
_PREPOSITIONS = _words(
    "in into inside on onto upon to next near beside besides behind by under below beneath above over between at with "
    "against within toward towards before from off of for left right front"
)
_VERBS = _words(
    "take grab get pick put place move set bring lift drop lay pour stack push give hand pass throw slide leave"
)
_JOINTS = _words("and then up")


@dataclass(frozen=True, slots=True)
class Phrases:
    """Ranges of word numbers (first, one after the last) of the object's and of the target's phrase, or None."""

    object: tuple[int, int] | None
    target: tuple[int, int] | None


def find_phrases(words: Sequence[str]) -> Phrases:
    """Find the object's and the target's phrase by the small words around them, whatever the nouns are."""
    tokens = [word.lower().strip(".,!?;:\"'") for word in words]
    first = _object_phrase(tokens)
    if first is None and not _VERBS & set(tokens):
        return Phrases(None, None)  # "hello there" asks for nothing
    return Phrases(first, _target_phrase(tokens, first[1] if first is not None else 0))


def _object_phrase(tokens: Sequence[str]) -> tuple[int, int] | None:
    start = next((i for i, token in enumerate(tokens) if token in _DETERMINERS), None)
    if start is None:
        # "put banana in bowl": the words between the verb and the first preposition.
        verb = next((i for i, token in enumerate(tokens) if token in _VERBS), None)
        if verb is None:
            return None
        start = verb + 1
        while start < len(tokens) and tokens[start] in _JOINTS:
            start += 1
    end = start + 1 if start < len(tokens) and tokens[start] in _DETERMINERS else start
    while end < len(tokens) and not _breaks(tokens, end):
        end += 1
    return (start, end) if end > start else None


def _breaks(tokens: Sequence[str], i: int) -> bool:
    token = tokens[i]
    if token in ("left", "right", "front"):  # "the left mug" is one object, "the mug left of" is not
        return i + 1 < len(tokens) and tokens[i + 1] in ("of", "to")
    return token in _PREPOSITIONS | _PLACES | _VERBS | _JOINTS


def _target_phrase(tokens: Sequence[str], after: int) -> tuple[int, int] | None:
    for i in range(len(tokens) - 1, after - 1, -1):
        if tokens[i] in _PLACES:
            return (i - 1 if i > after and tokens[i - 1] == "over" else i, i + 1)
        if tokens[i] in _DETERMINERS:
            return (i, len(tokens))
    # "put banana in bowl": what follows the last preposition.
    for i in range(len(tokens) - 2, after - 1, -1):
        if tokens[i] in _PREPOSITIONS:
            return (i + 1, len(tokens))
    return None
