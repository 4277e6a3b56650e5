# SPDX-License-Identifier: Apache-2.0
"""What the detector is asked for: noun phrases without places, sizes to compare, or pointing words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from uncom_language.types import Command, Reference, Relation

OBJECTS = "objects"
CONTAINER = "container"

GENERIC_NOUNS = (
    "thing",
    "things",
    "object",
    "objects",
    "item",
    "items",
    "one",
    "ones",
    "stuff",
    "something",
    "anything",
)
GENERIC_HEADS = frozenset((*GENERIC_NOUNS, "this", "that", "these", "those", "it", "them", "here", "there"))
TABLE_HEADS = frozenset(["table", "desk", "tabletop", "counter", "countertop", "surface", "worktop"])
PLACE_HEADS = frozenset(["here", "there", "place", "spot", "area", "space", "position", "location"])
PART_RELATIONS = {"top": Relation.ON, "surface": Relation.ON, "inside": Relation.IN}
SUBSTITUTE_HEADS = frozenset(("one", "ones"))
# words that compare objects of a kind; the value says which way to sort
POSITION_WORDS = {
    "left": "left",
    "leftmost": "left",
    "right": "right",
    "rightmost": "right",
    "far": "far",
    "front": "near",
    "frontmost": "near",
    "nearest": "near",
    "closest": "near",
    "closer": "near",
    "nearer": "near",
    "back": "far",
    "rear": "far",
    "farthest": "far",
    "furthest": "far",
    "farther": "far",
    "further": "far",
    "middle": "middle",
    "center": "middle",
    "centre": "middle",
    "central": "middle",
}
SIZE_WORDS = {
    "big": "large",
    "bigger": "large",
    "biggest": "large",
    "large": "large",
    "larger": "large",
    "largest": "large",
    "small": "small",
    "smaller": "small",
    "smallest": "small",
    "little": "small",
    "tiny": "small",
    "tall": "tall",
    "taller": "tall",
    "tallest": "tall",
    "short": "low",
    "shorter": "low",
    "shortest": "low",
    "long": "long",
    "longer": "long",
    "longest": "long",
}


SIDE_RELATIONS = (Relation.LEFT_OF, Relation.RIGHT_OF, Relation.IN_FRONT_OF, Relation.BEHIND)
SIDE_AXES = frozenset(("left", "right", "near", "far"))


def is_bare(reference: Reference) -> bool:
    """Whether a reference names no kind of object ("this", "that thing", "it")."""
    return reference.head.lower() in GENERIC_HEADS or not reference.head


def is_pronoun(reference: Reference) -> bool:
    """Whether a reference is "it" or "them" with no noun that it was resolved to."""
    return reference.head.lower() in ("it", "them") and not reference.deictic


def is_unspecific(reference: Reference) -> bool:
    """Whether words alone cannot tell which object is meant: no kind, no quality, no order, no comparison."""
    said = (
        reference.modifiers,
        reference.ordinal,
        reference.comparison,
        reference.anchor,
        reference.excluded_modifiers,
    )
    return is_bare(reference) and not any(said) and not reference.other


def asks_to_return(command: Command) -> bool:
    """Whether the object is to go back to where it was before ("put it back", "return the lemon")."""
    words = (*command.action_text.lower().split(), *(command.target.text.lower().split() if command.target else ()))
    return command.target is None and ("back" in words or "return" in words)


def is_place_word(reference: Reference) -> bool:
    """Whether a reference is a place that is only pointed at ("here", "this spot")."""
    return reference.head.lower() in PLACE_HEADS or (not reference.head and reference.deictic in ("here", "there"))


def is_table(reference: Reference) -> bool:
    """Whether a reference is the support itself."""
    return reference.head.lower() in TABLE_HEADS


def detector_phrase(reference: Reference, antecedent: str = "") -> str:
    """Return the noun phrase that the detector is asked for.

    Words that compare or locate are left out (the reasoner weighs them itself); "one" takes the noun it stands for.
    """
    kept = [m for m in reference.modifiers if m.lower() not in POSITION_WORDS and m.lower() not in SIZE_WORDS]
    head = reference.head.lower()
    if head in SUBSTITUTE_HEADS and antecedent:
        return " ".join([*kept, antecedent])
    if is_bare(reference) or is_place_word(reference) or is_table(reference):
        return " ".join([*kept, "object"]) if kept and not is_place_word(reference) else OBJECTS
    if reference.ordinal or reference.ordinal_side:
        return " ".join([*kept, head])  # the text of "second cup" counts, its modifiers do not
    words = [w for w in reference.text.lower().split() if w not in POSITION_WORDS and w not in SIZE_WORDS]
    return " ".join(words) or head


def comparison_axes(reference: Reference) -> tuple[str, ...]:
    """Return the axes along which the wanted object stands out among its kind: left, right, near, far, middle, ..."""
    words = [m.lower() for m in reference.modifiers]
    return tuple((POSITION_WORDS | SIZE_WORDS)[w] for w in words if w in POSITION_WORDS or w in SIZE_WORDS)


def ordinal_axis(reference: Reference) -> str:
    """Return what an ordinal counts along: its side, a superlative ("the second biggest"), else from the left."""
    if reference.ordinal_side:
        return POSITION_WORDS.get(reference.ordinal_side, "left")
    return next(iter(comparison_axes(reference)), "left")


def depends_on_perspective(command: Command) -> bool:
    """Whether something in a command hangs on whose left and right, or front and back, is meant."""
    if command.relation in SIDE_RELATIONS and not (command.target is not None and is_table(command.target)):
        return True
    for reference in iterate_references(command):
        words = {*comparison_axes(reference), *(m.lower() for m in reference.modifiers)}
        along = ordinal_axis(reference) if reference.ordinal else ""
        if words & SIDE_AXES or along in SIDE_AXES or reference.anchor_relation in {r.value for r in SIDE_RELATIONS}:
            return True
    return False


def replace_parts(command: Command) -> Command:
    """Return a command in which "the top of the box" is the box: parts of objects are no objects of their own."""
    target = command.target
    if target is None or target.anchor is None or target.head.lower() not in PART_RELATIONS:
        return command
    whole = replace(target.anchor, span=target.span)
    return replace(command, target=whole, relation=PART_RELATIONS[target.head.lower()])


def resolve_antecedent(command: Command, remembered: str = "") -> str:
    """Return the noun that "one" stands for in a command: that of its object, else the remembered one."""
    reference = command.object
    return reference.head.lower() if reference is not None and not is_bare(reference) else remembered


def iterate_references(command: Command) -> Iterator[Reference]:
    """Yield all references of a command, the nested ones too."""
    pending = [command.object, command.target, command.reference2]
    while pending:
        reference = pending.pop(0)
        if reference is not None:
            yield reference
            pending += [reference.anchor, reference.compared_to]


def phrases_for(command: Command, remembered: str = "") -> tuple[str, ...]:
    """Return every phrase that grounding a command needs scores for, without repetition."""
    antecedent = resolve_antecedent(command, remembered)
    named = [detector_phrase(reference, antecedent) for reference in iterate_references(command)]
    excluded = [word.lower() for reference in iterate_references(command) for word in reference.excluded_modifiers]
    return tuple(dict.fromkeys([*named, *excluded, CONTAINER, OBJECTS]))


def leaves_choice_open(reference: Reference, command: Command) -> bool:
    """Whether the speaker left the choice open ("a banana", "any apple"): every such object is right."""
    if reference.deictic or reference.anchor is not None or reference.other:
        return False
    phrase = re.escape(reference.text.lower())
    return bool(phrase) and re.search(rf"\b(a|an|any|some|one)\s+{phrase}\b", command.text.lower()) is not None
