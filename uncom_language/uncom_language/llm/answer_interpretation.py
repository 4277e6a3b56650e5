# SPDX-License-Identifier: Apache-2.0
"""Object, action and target as a language model names them, to a Command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from uncom_common.primitive import Primitive

from uncom_language.parser.grammar_parser import even_spans, load_parser
from uncom_language.parser.lexical.tagger import split_text
from uncom_language.types import Act, Command, Reference, Relation, Span, Transcript

_QUESTIONS = {
    "object": "the object is missing: what shall I {action}?",
    "target": "the target is missing: where shall I {action} {object}?",
}


def command_from_answer(answer: Mapping[str, Any], transcript: Transcript, language: str, backend: str) -> Command:
    """Return the command that a validated, refined answer means.

    The model finds the three parts; which primitive and relation they are is read by the grammar from their words.
    """
    parts = {name: answer[name] for name in ("object", "action", "target") if answer[name] != ""}
    command = Command(transcript.utterance_id, Act.COMMAND, transcript.text, backend=backend)
    if "action" not in parts:
        return replace(command, act=Act.REFUSED, reason=f"{transcript.text!r} is no command for me")
    action = str(parts["action"]["text"]).lower()
    order = " ".join(str(parts[name]["text"]) for name in ("action", "object", "target") if name in parts)
    read = _by_grammar(order, language)
    if read is None or read.primitive is Primitive.NONE:
        return replace(command, act=Act.REFUSED, reason=f"I do not know how to {action!r}")
    command = replace(
        command,
        action_text=action,
        action_span=_span(parts["action"]),
        primitive=read.primitive,
        relation=read.relation,
        object=_reference(parts.get("object"), read.object),
        target=_reference(parts.get("target"), read.target),
        reference2=read.reference2,
        distance_m=read.distance_m,
    )
    if read.act is Act.INCOMPLETE:
        name = "object" if command.object is None else "target"
        reference = command.object.text if command.object else ""
        return replace(command, act=Act.INCOMPLETE, reason=_QUESTIONS[name].format(action=action, object=reference))
    return command


def _by_grammar(order: str, language: str) -> Command | None:
    spans = even_spans(sum(not item.is_break for item in split_text(order)))
    found: Sequence[Command] = load_parser(language).parse(order, spans)
    return found[-1] if found[-1].act in (Act.COMMAND, Act.INCOMPLETE) else None


def _span(part: Mapping[str, Any]) -> Span:
    start_s, end_s = part["timestamp"]
    return Span(float(start_s), float(end_s))


def _reference(part: Mapping[str, Any] | None, read: Reference | None) -> Reference | None:
    """Return a part with the model's times and its word on what is concrete."""
    if part is None:
        return None
    span = _span(part)
    if read is None:
        words = str(part["text"]).lower().split()
        read = Reference(" ".join(words), words[-1], span, tuple(words[:-1]))
    deictic = span if read.deictic else None
    return replace(read, span=span, deictic_span=deictic, concrete=bool(part["concrete"]))


def agreement_key(command: Command) -> tuple[Primitive, Relation, str, str]:
    """Return what two readings of the same words must share to agree."""
    reference = command.object.head if command.object else ""
    place = command.target.head if command.target else ""
    return command.primitive, command.relation, reference, place
