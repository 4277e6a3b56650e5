# SPDX-License-Identifier: Apache-2.0
"""Commands as JSON: the layout that `uncom parse` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from uncom_language.types import Act, Command, Reference

_WITH_PARTS = (Act.COMMAND, Act.INCOMPLETE, Act.FRAGMENT, Act.CORRECTION)


def reference_to_json(reference: Reference | None) -> dict[str, Any] | None:
    """Return one part of a command, None if it is missing."""
    if reference is None:
        return None
    made: dict[str, Any] = {
        "text": reference.text,
        "head": reference.head,
        "modifiers": list(reference.modifiers),
        "concrete": reference.concrete,
        "deictic": reference.deictic,
        "anaphoric": reference.anaphoric,
        "other": reference.other,
        "quantity": reference.quantity,
        "timestamp": [round(reference.span.start_s, 3), round(reference.span.end_s, 3)],
    }
    if reference.deictic_span is not None:
        made["deictic_timestamp"] = [round(reference.deictic_span.start_s, 3), round(reference.deictic_span.end_s, 3)]
    if reference.excluded_modifiers:
        made["excluded"] = list(reference.excluded_modifiers)
    if reference.ordinal:
        made["ordinal"], made["ordinal_side"] = reference.ordinal, reference.ordinal_side
    if reference.comparison:
        made["comparison"] = {"kind": reference.comparison, "reference": reference_to_json(reference.compared_to)}
    if reference.heard:
        made["heard"] = reference.heard
    if reference.anchor is not None:
        made["anchor"] = {"relation": reference.anchor_relation, "reference": reference_to_json(reference.anchor)}
    return made


def command_to_json(command: Command) -> dict[str, Any]:
    """Return one command: object, action, target, relation, reference2."""
    action: dict[str, Any] = {"text": command.action_text, "primitive": command.primitive.value}
    if command.action_span is not None:
        action["timestamp"] = [round(command.action_span.start_s, 3), round(command.action_span.end_s, 3)]
    return {
        "object": reference_to_json(command.object),
        "action": action,
        "target": reference_to_json(command.target),
        "relation": command.relation.value,
        "distance_m": command.distance_m,
        "reference2": reference_to_json(command.reference2),
        "act": command.act.name.lower(),
        "reason": command.reason,
        "notes": list(command.notes),
    }


def sentence_to_json(text: str, commands: Sequence[Command]) -> dict[str, Any]:
    """Return one sentence: its commands, the act of the whole, the reason if something is wrong, the back end."""
    parts = [command for command in commands if command.act in _WITH_PARTS]
    act = next((c.act for c in commands if c.act is not Act.COMMAND), commands[0].act if commands else Act.REFUSED)
    if act in (Act.YES, Act.NO) and parts:
        act = parts[0].act
    return {
        "text": text,
        "commands": [command_to_json(command) for command in parts],
        "act": act.name.lower(),
        "reason": next((command.reason for command in commands if command.reason), ""),
        "backend": commands[0].backend if commands else "",
    }
