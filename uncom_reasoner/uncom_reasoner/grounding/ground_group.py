# SPDX-License-Identifier: Apache-2.0
"""Several objects at once: "both apples", "two spoons", "these", "all the fruit"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from uncom_language.types import Command, Reference

from uncom_reasoner.exceptions import AmbiguousError, NothingSeenError
from uncom_reasoner.grounding.options import GROUP, GroupOptions
from uncom_reasoner.grounding.phrasing import pluralize, repeat_reference
from uncom_reasoner.posterior.posterior import NONE, NUMBERS
from uncom_reasoner.types import Candidate
from uncom_reasoner.weights import Weights

ALL = 0  # quantity of "all the fruit"


def select_members(
    candidates: Sequence[Candidate],
    reference: Reference,
    command: Command,
    weights: Weights,
    *,
    pointed: bool,
    options: GroupOptions = GROUP,
) -> tuple[Candidate, ...]:
    """Return the objects that a reference to several means, likeliest first.

    Args:
        candidates: of the reference, likeliest first, "none" among them.
        reference: with its quantity; 0 is all.
        command: whose words tell whether any will do ("two apples" and not "the two apples").
        weights: the thresholds.
        pointed: whether a gesture goes with it.
        options: what is of the same kind.

    Raises:
        NothingSeenError: there is none, or fewer than were asked for.
        AmbiguousError: there are more than were asked for, and nothing tells which.
    """
    objects = [c for c in candidates if c.id != NONE]
    none = sum(c.probability for c in candidates if c.id == NONE)
    if not objects or none > sum(c.probability for c in objects):
        raise NothingSeenError(f"I do not see {repeat_reference(reference)} on the table.", candidates)
    odds = options.pointed_odds if pointed else options.member_odds
    found = tuple(c for c in objects if c.probability * odds >= objects[0].probability)
    count = reference.quantity
    if count == ALL or len(found) == count:
        return found
    name = pluralize(reference)
    if len(found) < count:
        seen = NUMBERS[len(found)] if len(found) < len(NUMBERS) else str(len(found))
        raise NothingSeenError(f"I see only {seen} of the {name}.", candidates)
    clear = found[count - 1].probability >= weights.min_odds * found[count].probability
    if clear or leaves_members_open(reference, command):
        return found[:count]
    raise AmbiguousError(f"I see more {name} than that: {len(found)}.", candidates, tuple(c.id for c in found))


def leaves_members_open(reference: Reference, command: Command) -> bool:
    """Whether the speaker left open which ones: "two apples", but not "the two apples" or "both apples"."""
    if reference.deictic or reference.anchor is not None or reference.other:
        return False
    said = command.text.lower()
    phrase = re.escape(reference.text.lower())
    return re.search(rf"\b(both|the \w+|these \w+|those \w+|all)( of the)?\s+{phrase}\b", said) is None
