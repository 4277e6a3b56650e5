# SPDX-License-Identifier: Apache-2.0
"""The cheapest question that splits the candidates: by kind, colour, size, side, neighbour; else one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from shapely.geometry import Polygon
from uncom_perception.types import Detection

from uncom_reasoner.dialogue.types import Question, QuestionKind
from uncom_reasoner.grounding.perspective import SIDE_WORDS
from uncom_reasoner.posterior.comparatives import quantity
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.posterior import colour_of
from uncom_reasoner.types import Decision

MOST_CHOICES = 3
CLEAR_SIZE = 0.18  # difference of sizes (in logarithms) that a person sees at once
CLEAR_SIDE_M = 0.08
BESIDE_M = 0.15
ELSEWHERE = {
    "left": ("on the left", "in the middle", "on the right"),
    "near": ("in front", "in the middle", "at the back"),
}


def question_for(decision: Decision, context: Context, timeout_s: float) -> Question | None:
    """Return what to ask about an ambiguous decision, or None if nothing can be asked."""
    doubt = decision.doubt
    if doubt is None:
        return None
    g = decision.grounded
    name = f"{doubt.part}-{g.utterance_id}-{g.index}"
    if not doubt.choices:  # a place: no list of choices, but a hand can show it, and words can tell it
        text = f"{g.reason} Please point at it again."
        return Question(name, g.utterance_id, QuestionKind.GROUNDING, text, (), (), timeout_s, doubt.part)
    if doubt.part == "perspective":
        words = tuple(SIDE_WORDS[side] for side in doubt.choices)
        text = f"Left and right, or front and back: {' or '.join(words)}?"
        return Question(name, g.utterance_id, QuestionKind.GROUNDING, text, words, doubt.choices, timeout_s, doubt.part)
    things = [context.thing(thing_id) for thing_id in doubt.choices]
    if len(things) == 1:
        words = (names_of(things, context)[0],)
        text = f"{g.reason} Do you mean the {words[0]}?".strip()
    else:
        words = tuple(f"the {word}" for word in names_of(things, context))
        text = asked(words) if len(things) <= MOST_CHOICES else f"{g.reason} Please point at it or tell me more."
    return Question(name, g.utterance_id, QuestionKind.GROUNDING, text, words, doubt.choices, timeout_s, doubt.part)


def asked(words: Sequence[str]) -> str:
    """Return the question for two or three choices."""
    return f"Do you mean {', '.join(words[:-1])} or {words[-1]}?" if len(words) > 1 else f"Do you mean {words[0]}?"


def names_of(things: Sequence[Detection], context: Context) -> tuple[str, ...]:
    """Return a name for each thing, by the first way in which no two are called the same."""
    nouns = [thing.label or "thing" for thing in things]
    ways: tuple[Callable[[], Sequence[str]], ...] = (
        lambda: nouns,
        lambda: [_with_colour(thing, noun) for thing, noun in zip(things, nouns, strict=True)],
        lambda: _by_size(things, nouns, context),
        lambda: _by_side(things, nouns, context, "left"),
        lambda: _by_side(things, nouns, context, "near"),
        lambda: [_by_neighbour(thing, noun, things, context) for thing, noun in zip(things, nouns, strict=True)],
    )
    for way in ways:
        names = list(way())
        if len(set(names)) == len(things):
            return tuple(names)
    by_side = _in_order(things, nouns, context)
    return tuple(by_side)


def _with_colour(thing: Detection, noun: str) -> str:
    colour = colour_of(thing)
    return f"{colour} {noun}" if colour and colour not in noun else noun


def _by_size(things: Sequence[Detection], nouns: Sequence[str], context: Context) -> Sequence[str]:
    if len(things) != 2 or nouns[0] != nouns[1]:
        return nouns
    sizes = [quantity("large", thing, context) for thing in things]
    if abs(sizes[0] - sizes[1]) < CLEAR_SIZE:
        return nouns
    words = ("bigger", "smaller") if sizes[0] > sizes[1] else ("smaller", "bigger")
    return [f"{word} {noun}" for word, noun in zip(words, nouns, strict=True)]


def _by_side(things: Sequence[Detection], nouns: Sequence[str], context: Context, way: str) -> Sequence[str]:
    if len(things) > 3:
        return nouns
    places = [quantity(way, thing, context) for thing in things]
    order = [int(i) for i in np.argsort([-p for p in places])]
    steps = -np.diff([places[i] for i in order])
    if len(steps) and steps.min() < CLEAR_SIDE_M * context.surface.unit:
        return nouns
    words = ELSEWHERE[way] if len(things) == 3 else (ELSEWHERE[way][0], ELSEWHERE[way][2])
    names = list(nouns)
    for word, i in zip(words, order, strict=False):
        names[i] = f"{nouns[i]} {word}"
    return names


def _by_neighbour(thing: Detection, noun: str, things: Sequence[Detection], context: Context) -> str:
    """Return "mug next to the box": with a neighbour that is not asked about itself."""
    shape = context.footprints[thing.id]
    asked_about = {other.id for other in things}
    near: list[tuple[float, str]] = []
    for other in context.things:
        outline: Polygon = context.footprints[other.id]
        if other.id not in asked_about and not outline.is_empty and not shape.is_empty and other.label:
            near.append((float(shape.distance(outline)), _with_colour(other, other.label)))
    gap, name = min(near, default=(np.inf, ""))
    return f"{noun} next to the {name}" if gap <= BESIDE_M * context.surface.unit else noun


def _in_order(things: Sequence[Detection], nouns: Sequence[str], context: Context) -> Sequence[str]:
    """Number them from the left: what always works."""
    numbers = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
    places = [-quantity("left", thing, context) for thing in things]
    names = list(nouns)
    for rank, i in enumerate(np.argsort(places, kind="stable")):
        number = numbers[rank] if rank < len(numbers) else f"number {rank + 1}"
        names[int(i)] = f"{number} {nouns[int(i)]} from the left"
    return names
