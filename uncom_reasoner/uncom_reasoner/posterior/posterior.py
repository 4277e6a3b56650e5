# SPDX-License-Identifier: Apache-2.0
"""From log factors to a choice: normalised with "none of these", and settled only if it is clear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from uncom_perception.types import Detection

from uncom_reasoner.exceptions import AmbiguousError, NothingSeenError
from uncom_reasoner.types import Candidate, Choice, Rule
from uncom_reasoner.weights import Weights

NONE = "none"
NEAR_PROBABILITY = 0.03
NEAR_ODDS = 2.0
NEAR_RAY_LOG = 2.0
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def normalised(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return the candidates with probabilities from their factors, likeliest first."""
    if not candidates:
        return ()
    logs = np.array([c.log for c in candidates])
    p = np.exp(logs - logs.max())
    p = p / p.sum()
    order = np.argsort(-p, kind="stable")
    return tuple(replace(candidates[i], probability=float(p[i])) for i in order)


def chosen(candidates: Sequence[Candidate], chosen_id: str, rule: Rule = Rule.CLEAR) -> Choice:
    """Mark one candidate."""
    marked = tuple(replace(c, chosen=c.id == chosen_id) for c in candidates)
    return Choice(marked, chosen_id, next(c.probability for c in marked if c.chosen), rule)


def settle(
    candidates: Sequence[Candidate], what: str, weights: Weights, *, any_will_do: bool = False, part: str = ""
) -> Choice:
    """Choose the likeliest candidate (of `normalised`) if it is clear.

    Args:
        candidates: likeliest first, "none" among them.
        what: how the speaker called it, for the reason.
        weights: the thresholds.
        any_will_do: the speaker left it open, so that several that fit are no reason to ask.
        part: of the command, for a question about it.

    Raises:
        NothingSeenError: "none" is likelier than every thing together, or nothing was seen.
        AmbiguousError: the best two are too close.
    """
    things = [c for c in candidates if c.id != NONE]
    none = sum(c.probability for c in candidates if c.id == NONE)
    if not things or none > sum(c.probability for c in things):
        unseen = f"I do not see {what} on the table."
        likely = _near_miss([c for c in things if not _answered_no(c)])
        if likely is not None:
            raise AmbiguousError(unseen, candidates, (likely.id,), part)
        raise NothingSeenError(unseen, candidates)
    best = things[0]
    second = things[1].probability if len(things) > 1 else 0.0
    share = best.probability / sum(c.probability for c in things)
    clear = share >= weights.min_probability and best.probability >= weights.min_odds * second
    if clear or any_will_do:
        return chosen(candidates, best.id, Rule.CLEAR if clear else Rule.ANY)
    close = [c for c in things if c.probability * weights.min_odds * 1.5 > best.probability]
    if len(close) < 2:
        close = things[:2]
    raise AmbiguousError(_which(what, close), candidates, tuple(c.id for c in close), part)


def _answered_no(candidate: Candidate) -> bool:
    return any(factor.name == "answer" and factor.log < 0.0 for factor in candidate.factors)


def _near_miss(things: Sequence[Candidate]) -> Candidate | None:
    """Return the one thing worth asking about though the words do not fit: half fitting words, or a plain gesture.

    Misheard words and things taken for others are more frequent than people who speak of what is not there.
    """
    if not things:
        return None
    best, rest = things[0], sum(c.probability for c in things[1:])
    stands_out = best.probability >= NEAR_ODDS * max(rest, 1e-12)
    if stands_out and best.probability >= NEAR_PROBABILITY:
        return best
    rays = sorted((factor.log, c.id) for c in things for factor in c.factors if factor.name == "ray")
    if len(rays) > 1 and rays[-1][0] - rays[-2][0] >= NEAR_RAY_LOG:
        return next(c for c in things if c.id == rays[-1][1])
    return None


def _which(what: str, close: Sequence[Candidate]) -> str:
    count = NUMBERS[len(close)] if len(close) < len(NUMBERS) else str(len(close))
    names = sorted({c.label for c in close})
    if len(names) == 1:
        return f"I could not tell which {_bare(what)} you mean: there are {count}."
    return f"I could not tell what you mean by {what}: {_listed(['the ' + name for name in names])}?"


def _bare(what: str) -> str:
    return what.removeprefix("the ").removeprefix("a ") or "thing"


def _listed(names: Sequence[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else names[0]


def colour_of(detection: Detection) -> str:
    """Return the name of a thing's colour if it is sure enough, else ""."""
    colours = (a for a in detection.attributes if a.name in ("colour", "color"))
    best = max(colours, key=lambda a: a.probability, default=None)
    return best.value if best is not None and best.probability > 0.5 else ""


def label_of(detection: Detection) -> str:
    """Return how to name a thing: its colour and what it seems to be."""
    colour = colour_of(detection)
    name = detection.label or "thing"
    return name if not colour or colour in name else f"{colour} {name}"
