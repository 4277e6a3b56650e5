# SPDX-License-Identifier: Apache-2.0
"""Which of the phrases behind a noun phrase say where the object is to go."""

from __future__ import annotations

from collections.abc import Sequence

from uncom_language.parser.syntax.locative_phrases import SUPPORTING, LocativePhrase
from uncom_language.types import Reference


def ends_with_phrase(places: Sequence[LocativePhrase], index: int) -> bool:
    """Whether a phrase is the end of "the plate with the lemon on it"."""
    if index == 0 or not (places[index].references and places[index].references[0].anaphoric):
        return False
    before = places[index - 1]
    return before.kind == "compared" and before.relation == "with"


def split_exclusions(
    references: Sequence[Reference], targets: Sequence[LocativePhrase]
) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
    """Take "except the green one" from the end of the target, unless it repeats the target's noun."""
    heads = {reference.head for place in targets if place.kind != "excepted" for reference in place.references}
    heads -= {reference.head for reference in references}
    of_object = [
        place
        for place in targets
        if place.kind == "excepted"
        and references
        and not any(reference.head in heads for reference in place.references)
    ]
    return [place for place in targets if place not in of_object], of_object


def find_target_start(places: list[LocativePhrase], free: list[int]) -> int:
    """Return which phrase of a chain says where to.

    "the cup next to the bottle on the plate": the last supporting phrase (in, on) is where objects go and what
    stands before it tells which object; without one the first phrase is it, but "on the left" tells which object if
    another phrase follows. "Into", "onto" and "to" are always it.
    """
    directed = [index for index in free if places[index].directed and places[index].kind != "side"]
    if directed:
        return directed[0]
    pointed = [index for index in free if places[index].kind == "here"]
    if pointed and pointed[-1] == len(places) - 1:
        return pointed[-1]
    supporting = [index for index in free if places[index].relation in SUPPORTING and places[index].kind == "located"]
    if supporting:
        return supporting[-1]
    restricting = [index for index in free if places[index].kind == "side" and not places[index].directed]
    going = [index for index in free if index not in restricting]
    going = [index for index in going if places[index].toward] or going
    return going[0] if going else free[-1]
