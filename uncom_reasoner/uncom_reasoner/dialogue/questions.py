# SPDX-License-Identifier: Apache-2.0
"""The cheapest question that splits the candidates: by kind, colour, size, side, neighbour; else one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from shapely.geometry import Polygon
from uncom_perception.types import Detection

from uncom_reasoner.dialogue.options import QUESTION, QuestionOptions
from uncom_reasoner.dialogue.types import Question, QuestionKind
from uncom_reasoner.grounding.perspective import SIDE_WORDS
from uncom_reasoner.posterior.comparatives import measure_axis
from uncom_reasoner.posterior.context import Context
from uncom_reasoner.posterior.posterior import dominant_colour
from uncom_reasoner.types import Decision

SIDE_PHRASES = {
    "left": ("on the left", "in the middle", "on the right"),
    "near": ("in front", "in the middle", "at the back"),
}


def formulate_question(
    decision: Decision, context: Context, timeout_s: float, options: QuestionOptions = QUESTION
) -> Question | None:
    """Return what to ask about an ambiguous decision, or None if nothing can be asked.

    Args:
        decision: with its doubt.
        context: that it was made in.
        timeout_s: how long the question stays open [s].
        options: how choices are named.
    """
    doubt = decision.doubt
    if doubt is None:
        return None
    g = decision.grounded
    name = f"{doubt.part}-{g.utterance_id}-{g.index}"

    def question(text: str, choices: tuple[str, ...], ids: tuple[str, ...]) -> Question:
        return Question(name, g.utterance_id, QuestionKind.GROUNDING, text, choices, ids, timeout_s, doubt.part)

    if not doubt.choices:  # a place: no list of choices, but a hand can show it, and words can tell it
        return question(f"{g.reason} Please point at it again.", (), ())
    if doubt.part == "perspective":
        words = tuple(SIDE_WORDS[side] for side in doubt.choices)
        return question(f"Left and right, or front and back: {' or '.join(words)}?", words, doubt.choices)
    objects = [context.detection(name) for name in doubt.choices]
    names = name_distinctly(objects, context, options)
    if len(objects) == 1:
        return question(f"{g.reason} Do you mean the {names[0]}?".strip(), names, doubt.choices)
    words = tuple(f"the {word}" for word in names)
    is_short = len(objects) <= options.max_choices
    text = ask_between(words) if is_short else f"{g.reason} Please point at it or tell me more."
    return question(text, words, doubt.choices)


def ask_between(words: Sequence[str]) -> str:
    """Return the question for two or three choices."""
    return f"Do you mean {', '.join(words[:-1])} or {words[-1]}?" if len(words) > 1 else f"Do you mean {words[0]}?"


def name_distinctly(
    objects: Sequence[Detection], context: Context, options: QuestionOptions = QUESTION
) -> tuple[str, ...]:
    """Return a name for each object, by the first kind of name by which no two are called the same."""
    nouns = [detection.label or "thing" for detection in objects]
    namings: tuple[Callable[[], Sequence[str]], ...] = (
        lambda: nouns,
        lambda: [_with_colour(detection, noun) for detection, noun in zip(objects, nouns, strict=True)],
        lambda: _by_size(objects, nouns, context, options),
        lambda: _by_side(objects, nouns, context, "left", options),
        lambda: _by_side(objects, nouns, context, "near", options),
        lambda: [_by_neighbour(d, noun, objects, context, options) for d, noun in zip(objects, nouns, strict=True)],
    )
    for naming in namings:
        names = tuple(naming())
        if len(set(names)) == len(objects):
            return names
    return tuple(_numbered(objects, nouns, context))


def _with_colour(detection: Detection, noun: str) -> str:
    colour = dominant_colour(detection)
    return f"{colour} {noun}" if colour and colour not in noun else noun


def _by_size(
    objects: Sequence[Detection], nouns: Sequence[str], context: Context, options: QuestionOptions
) -> Sequence[str]:
    """Return "bigger mug" and "smaller mug" for two of a kind whose sizes are clearly different."""
    match [measure_axis("large", detection, context) for detection in objects]:
        case [first, second] if len(set(nouns)) == 1 and abs(first - second) >= options.clear_size_log:
            words = ("bigger", "smaller") if first > second else ("smaller", "bigger")
            return [f"{word} {noun}" for word, noun in zip(words, nouns, strict=True)]
    return nouns


def _by_side(
    objects: Sequence[Detection], nouns: Sequence[str], context: Context, axis: str, options: QuestionOptions
) -> Sequence[str]:
    """Return "mug on the left", "mug in the middle" ... where the places are clearly different along an axis."""
    phrases = SIDE_PHRASES[axis]
    if len(objects) > len(phrases):
        return nouns
    places = [measure_axis(axis, detection, context) for detection in objects]
    order = [int(i) for i in np.argsort([-p for p in places])]
    steps = -np.diff([places[i] for i in order])
    if len(steps) and steps.min() < options.clear_side_m * context.surface.units_per_m:
        return nouns
    words = phrases if len(objects) == len(phrases) else (phrases[0], phrases[-1])
    names = list(nouns)
    for word, i in zip(words, order, strict=False):
        names[i] = f"{nouns[i]} {word}"
    return names


def _by_neighbour(
    detection: Detection, noun: str, objects: Sequence[Detection], context: Context, options: QuestionOptions
) -> str:
    """Return "mug next to the box": with a neighbour that is not asked about itself."""
    shape = context.footprints[detection.id]
    asked_about = {other.id for other in objects}
    near: list[tuple[float, str]] = []
    for other in context.detections:
        outline: Polygon = context.footprints[other.id]
        if other.id not in asked_about and not outline.is_empty and not shape.is_empty and other.label:
            near.append((float(shape.distance(outline)), _with_colour(other, other.label)))
    gap, name = min(near, default=(np.inf, ""))
    return f"{noun} next to the {name}" if gap <= options.beside_m * context.surface.units_per_m else noun


def _numbered(objects: Sequence[Detection], nouns: Sequence[str], context: Context) -> Sequence[str]:
    """Number them from the left: what always works."""
    numbers = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
    places = [-measure_axis("left", detection, context) for detection in objects]
    names = list(nouns)
    for rank, i in enumerate(np.argsort(places, kind="stable")):
        number = numbers[rank] if rank < len(numbers) else f"number {rank + 1}"
        names[int(i)] = f"{number} {nouns[int(i)]} from the left"
    return names
