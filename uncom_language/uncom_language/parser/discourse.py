# SPDX-License-Identifier: Apache-2.0
"""Clauses of one utterance to commands: what is carried over from one clause to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from uncom_language.parser.syntax.clause import Clause
from uncom_language.types import Act, Command, Reference, Relation

_QUESTIONS = {
    "action": "the action is missing: what shall I do with {part}?",
    "object": "the object is missing: what shall I {part}?",
    "target": "the target is missing: where shall I {part}?",
}
_SUPPORTING = (Relation.IN, Relation.ON)
_VERBS_WITH_OBJECT = frozenset({"put", "stack", "pour", "push", "give"})


@dataclass(frozen=True, slots=True)
class Utterance:
    """What is the same for all commands of an utterance."""

    id: str
    text: str
    amends: bool = False  # it began with "no", "I meant": what follows changes the last command


def commands_from_clauses(said: Utterance, clauses: Sequence[Clause]) -> list[Command]:
    """Join "take X" with "put it there", carry pronouns and verbs over, and split objects that go together."""
    commands: list[Command] = []
    pending_pick: Clause | None = None
    previous: Clause | None = None
    for position, clause in enumerate(clauses):
        current = _with_verb_of(clause, previous)
        following = clauses[position + 1] if position + 1 < len(clauses) else None
        before = pending_pick or previous
        if clause.topic:
            before = replace(clause, objects=clause.topic, target=None)
        if current.kind == "take" and following is not None and _continues_pick(following, current):
            pending_pick = _resolve_pronouns(current, before)
            previous = pending_pick
            continue
        current = _resolve_pronouns(current, before)
        commands.extend(_commands_of(said, current))
        previous, pending_pick = current, None
    return commands


def _continues_pick(clause: Clause, taken: Clause) -> bool:
    """Whether a clause ends what "take X" began: it moves "it" (or X by its name) on, and does not pick it again."""
    if clause.kind in ("", "take", "point"):
        return clause.kind == "" and not clause.objects and clause.target is not None
    if (
        len(clause.objects) == len(taken.objects) == 1
        and clause.placed
        and _is_same_reference(taken.objects[0], clause.objects[0])
    ):
        return True
    return all(reference.anaphoric for reference in clause.objects) and not clause.topic


def _is_same_reference(first: Reference, second: Reference) -> bool:
    """Whether two named references are the same words for the same object."""
    alike = (first.text, first.quantity) == (second.text, second.quantity) and second.anchor is None
    return alike and second.concrete and not second.other and not second.deictic


def _with_verb_of(clause: Clause, previous: Clause | None) -> Clause:
    """Fill a fragment ("... and the apple on the plate") with the verb before it, and the place if it has none."""
    if clause.kind or previous is None or not previous.kind:
        return clause
    kind = "put" if previous.kind == "take" and clause.target is not None else previous.kind
    made = replace(
        clause,
        kind=kind,
        action_text=previous.action_text,
        action_span=previous.action_span,
        objects=clause.objects or previous.objects,
    )
    if clause.objects and not made.placed and previous.relation in _SUPPORTING:
        return replace(made, target=previous.target, relation=previous.relation)
    return made


def _resolve_pronouns(clause: Clause, before: Clause | None) -> Clause:
    """Replace "it" and "them" by what was spoken of before."""
    if before is None or not before.objects:
        return clause
    objects = clause.objects
    if not objects and clause.kind in _VERBS_WITH_OBJECT:
        objects = tuple(replace(reference, anaphoric=True) for reference in before.objects)
    elif any(reference.anaphoric for reference in objects):
        objects = tuple(
            replace(old, anaphoric=True, order=reference.order) if reference.anaphoric else reference
            for reference in objects
            for old in (before.objects if reference.anaphoric else (reference,))
        )
    target = clause.target
    if target is not None and target.anaphoric:
        target = replace(_antecedent_of_target(clause, before), anaphoric=True, order=target.order)
    return replace(clause, objects=objects, target=target)


def _antecedent_of_target(clause: Clause, before: Clause) -> Reference:
    """Return what "it" is in "next to it": where the object before went, if there was such a place.

    "Put the fork to the left of the plate and the knife to the right of it"; but "move the cup here and put the
    lid on it".
    """
    moved = any(reference.anaphoric for reference in clause.objects)
    if before.target is not None and before.target.concrete and (not moved or clause.relation in _SUPPORTING):
        return before.target
    return before.objects[0]


def _commands_of(said: Utterance, clause: Clause) -> list[Command]:
    if clause.kind == "stack" and not clause.placed and _are_two_single(clause.objects):
        first, second = clause.objects
        clause = replace(clause, objects=(first,), target=second, relation=Relation.ON)
    missing = clause.missing
    command = Command(
        utterance_id=said.id,
        act=Act.INCOMPLETE if missing else Act.COMMAND,
        text=said.text,
        action_text=clause.action_text,
        primitive=clause.primitive,
        action_span=clause.action_span,
        target=clause.target,
        reference2=clause.reference2,
        relation=clause.relation,
        reason=_question(clause, missing),
        distance_m=clause.distance_m,
    )
    if clause.kind == "stack" and clause.target is not None and command.relation is Relation.NONE:
        command = replace(command, relation=Relation.ON)
    if missing == "action":
        amends = said.amends or clause.is_exclusion or (clause.distance_m > 0.0 and not clause.objects)
        command = replace(command, act=Act.CORRECTION if amends else Act.FRAGMENT)
    return [replace(command, object=reference) for reference in clause.objects] or [command]


def _are_two_single(references: Sequence[Reference]) -> bool:
    """Whether exactly two objects are stacked: the first on the second."""
    return [reference.quantity for reference in references] == [1, 1]


def _question(clause: Clause, missing: str) -> str:
    if not missing:
        return ""
    if missing == "action":
        return _QUESTIONS[missing].format(part=clause.objects[0].text if clause.objects else "it")
    what = clause.objects[0].text if clause.objects else ""
    return _QUESTIONS[missing].format(part=" ".join(filter(None, [clause.action_text, what])))
