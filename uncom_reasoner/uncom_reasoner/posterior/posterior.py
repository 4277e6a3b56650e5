# SPDX-License-Identifier: Apache-2.0
"""From log factors to a choice: normalised with "none of these", and settled only if it is clear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from uncom_perception.types import Detection

from uncom_reasoner.exceptions import AmbiguousError, NothingSeenError
from uncom_reasoner.posterior.options import CHOICE, ChoiceOptions
from uncom_reasoner.types import Candidate, Choice, Rule
from uncom_reasoner.weights import Weights

NONE = "none"
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def normalize(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return the candidates with probabilities from their factors, likeliest first."""
    if not candidates:
        return ()
    logs = np.array([c.log for c in candidates])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    order = np.argsort(-p, kind="stable")
    return tuple(replace(candidates[i], probability=float(p[i])) for i in order)


def mark_chosen(candidates: Sequence[Candidate], chosen_id: str, rule: Rule = Rule.CLEAR) -> Choice:
    """Mark one candidate."""
    marked = tuple(replace(c, chosen=c.id == chosen_id) for c in candidates)
    return Choice(marked, chosen_id, next(c.probability for c in marked if c.chosen), rule)


def choose(
    candidates: Sequence[Candidate],
    what: str,
    weights: Weights,
    *,
    any_will_do: bool = False,
    part: str = "",
    options: ChoiceOptions = CHOICE,
) -> Choice:
    """Choose the likeliest candidate (of `normalize`) if it is clear.

    Args:
        candidates: likeliest first, "none" among them.
        what: how the speaker called it, for the reason.
        weights: the thresholds.
        any_will_do: the speaker left it open, so that several that fit are no reason to ask.
        part: of the command, for a question about it.
        options: of near misses.

    Raises:
        NothingSeenError: "none" is likelier than every object together, or nothing was seen.
        AmbiguousError: the best two are too close.
    """
    seen = [c for c in candidates if c.id != NONE]
    none = sum(c.probability for c in candidates if c.id == NONE)
    if not seen or none > sum(c.probability for c in seen):
        unseen = f"I do not see {what} on the table."
        likely = _find_near_miss([c for c in seen if not _answered_no(c)], options)
        if likely is not None:
            raise AmbiguousError(unseen, candidates, (likely.id,), part)
        raise NothingSeenError(unseen, candidates)
    best, *others = seen
    second = others[0].probability if others else 0.0
    share = best.probability / sum(c.probability for c in seen)
    clear = share >= weights.min_probability and best.probability >= weights.min_odds * second
    if clear or any_will_do:
        return mark_chosen(candidates, best.id, Rule.CLEAR if clear else Rule.ANY)
    close = [c for c in others if c.probability * weights.min_odds * options.close_factor > best.probability]
    doubtful = [best, *(close or others[:1])]
    raise AmbiguousError(_ask_which(what, doubtful), candidates, tuple(c.id for c in doubtful), part)


def _answered_no(candidate: Candidate) -> bool:
    return any(factor.name == "answer" and factor.log < 0.0 for factor in candidate.factors)


def _find_near_miss(seen: Sequence[Candidate], options: ChoiceOptions) -> Candidate | None:
    """Return the one object worth asking about though the words do not fit: half fitting words, or a plain gesture.

    Misheard words and objects taken for others are more frequent than people who speak of what is not there.
    """
    if not seen:
        return None
    best, rest = seen[0], sum(c.probability for c in seen[1:])
    stands_out = best.probability >= options.near_miss_odds * max(rest, 1e-12)
    if stands_out and best.probability >= options.near_miss_probability:
        return best
    rays = sorted((factor.log, c.id) for c in seen for factor in c.factors if factor.name == "ray")
    if len(rays) > 1 and rays[-1][0] - rays[-2][0] >= options.near_miss_ray_log:
        return next(c for c in seen if c.id == rays[-1][1])
    return None


def _ask_which(what: str, close: Sequence[Candidate]) -> str:
    count = NUMBERS[len(close)] if len(close) < len(NUMBERS) else str(len(close))
    names = sorted({c.label for c in close})
    if len(names) == 1:
        return f"I could not tell which {_without_article(what)} you mean: there are {count}."
    return f"I could not tell what you mean by {what}: {_join_or(['the ' + name for name in names])}?"


def _without_article(what: str) -> str:
    return what.removeprefix("the ").removeprefix("a ") or "thing"


def _join_or(names: Sequence[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]


def dominant_colour(detection: Detection, options: ChoiceOptions = CHOICE) -> str:
    """Return the name of an object's colour if it is sure enough, else "".

    The names and their probabilities are the perception's (uncom_perception/objects/attributes).
    """
    colours = (a for a in detection.attributes if a.name in ("colour", "color"))
    best = max(colours, key=lambda a: a.probability, default=None)
    return best.value if best is not None and best.probability > options.sure_colour else ""


def describe_detection(detection: Detection) -> str:
    """Return how to name an object: its colour and what it seems to be."""
    colour = dominant_colour(detection)
    name = detection.label or "thing"
    return name if not colour or colour in name else f"{colour} {name}"
