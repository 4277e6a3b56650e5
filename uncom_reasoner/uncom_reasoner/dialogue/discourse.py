# SPDX-License-Identifier: Apache-2.0
"""What a few words amend: an answer about one part, or a correction of the last command."""

from __future__ import annotations

from dataclasses import replace

from uncom_common.primitive import Primitive
from uncom_language.types import Act, Command, Reference, Relation

from uncom_reasoner.detector_phrases import SUBSTITUTE_HEADS, is_bare, is_place_word, is_table
from uncom_reasoner.types import Decision, Given, TargetKind


def amend_command(last: Command, said: Command, part: str = "") -> Command:
    """Return the last command with what was said now in the place of what it amends.

    Args:
        last: the command that was asked about, or done.
        said: a fragment or a correction.
        part: that was asked about; "" decides by the words.
    """
    changed = replace(last, utterance_id=said.utterance_id or last.utterance_id, act=Act.COMMAND, notes=())
    text = f"{last.text}; {said.text}".strip("; ")
    changed = replace(changed, text=text, index=said.index, count=said.count)
    if said.target is not None or said.relation is not Relation.NONE:
        changed = _amend_target(changed, said)
    if said.object is None:
        return changed
    where = part or ("object" if said.target is not None else find_amended_part(last, said.object))
    if where == "target":
        return replace(changed, target=_refine_reference(last.target, said.object))
    if where == "reference2":
        return replace(changed, reference2=_refine_reference(last.reference2, said.object))
    return replace(changed, object=_refine_reference(last.object, said.object))


def find_amended_part(last: Command, said: Reference) -> str:
    """Return which part of a command a reference amends: the one whose noun it repeats, else the object."""
    if is_place_word(said) or is_table(said):
        return "target"
    heads = {
        name: reference.head.lower()
        for name, reference in (("object", last.object), ("target", last.target), ("reference2", last.reference2))
        if reference is not None
    }
    same = [name for name, head in heads.items() if head == said.head.lower()]
    return same[0] if same else "object"


def _refine_reference(old: Reference | None, new: Reference) -> Reference:
    """Return the new words; "the green one" is an object of the old kind, "this" is whatever is pointed at."""
    if old is None or is_bare(old) or not (new.head.lower() in SUBSTITUTE_HEADS or (is_bare(new) and new.modifiers)):
        return new if old is None or new.deictic or not is_bare(new) or new.modifiers else replace(old, span=new.span)
    text = " ".join([*(m for m in new.modifiers), old.head])
    return replace(new, text=text, head=old.head, concrete=old.concrete, quantity=old.quantity)


def _amend_target(command: Command, said: Command) -> Command:
    primitive = command.primitive
    if said.primitive is not Primitive.NONE:
        primitive = said.primitive
    elif said.relation is Relation.IN:
        primitive = Primitive.PUT_IN
    elif said.relation is Relation.ON:
        primitive = Primitive.PUT_ON
    elif said.relation is not Relation.NONE or primitive in (Primitive.PICK, Primitive.NONE):
        primitive = Primitive.PLACE
    return replace(
        command,
        target=said.target,
        reference2=said.reference2,
        relation=said.relation,
        distance_m=said.distance_m,
        primitive=primitive,
    )


def given_after_correction(decision: Decision | None, said: Command, changed: Command, last: Command) -> Given:
    """Return what stays settled when a command that was decided is corrected.

    The part that is not spoken of stays what it was; an object that is corrected is not the one it was; "a bit to the
    left" starts from where the object was to go.

    Args:
        decision: on the last command.
        said: the correction.
        changed: the last command, amended.
        last: the last command.
    """
    if decision is None or decision.grounded.object is None:
        return Given()
    g = decision.grounded
    among: dict[str, frozenset[str]] = {}
    excluded: dict[str, frozenset[str]] = {}
    moved = frozenset((decision.grounded.object.id,))
    receiver = frozenset((g.target.detection.id,)) if g.target.detection is not None else frozenset()
    if changed.object is last.object:
        among["object"] = moved
    else:
        excluded["object"] = moved
    if changed.target is last.target and g.target.kind is TargetKind.OBJECT:
        among["target"] = receiver
    elif said.target is None and changed.target is not last.target and receiver:
        excluded["target"] = receiver
    start = decision.place if said.target is None and said.relation is not Relation.NONE else None
    return Given(among=among, excluded=excluded, perspective=decision.perspective, start=start)
