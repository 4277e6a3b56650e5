# SPDX-License-Identifier: Apache-2.0
"""Places on a part of the table: "in the corner", "at the edge of the table", "on its left side"."""

from __future__ import annotations

from dataclasses import replace

from uncom_common.primitive import Primitive

from uncom_language.parser.lexical.lexicon import Lexicon
from uncom_language.types import Command, Relation

_SIDE_RELATIONS = frozenset({Relation.LEFT_OF, Relation.RIGHT_OF, Relation.IN_FRONT_OF, Relation.BEHIND})
_PART_QUALITIES = frozenset({"left", "right", "front", "back", "far", "near", "nearest", "free"})
_PLACING_PRIMITIVES = frozenset({Primitive.PLACE, Primitive.PUT_IN, Primitive.PUT_ON})


def resolve_support_part(command: Command, lexicon: Lexicon) -> Command:
    """Read a part of the table as the table, which an object is put on; a note says that the part is not aimed at."""
    target = command.target
    supports, parts = (frozenset(lexicon.raw.get(name, ())) for name in ("supports", "support_parts"))
    if target is None or command.primitive not in _PLACING_PRIMITIVES or target.deictic or target.anchor is not None:
        return command
    words = set(target.text.split())
    named = next((word for word in target.text.split() if word in supports), "")
    is_part = target.head in parts or bool(words & parts and named)
    is_side = (
        command.relation in _SIDE_RELATIONS and target.head in supports and bool(parts & set(command.text.split()))
    )
    if not is_side and not (is_part and (named or words <= parts | _PART_QUALITIES)):
        return command
    head = named or next(iter(lexicon.raw["supports"]))
    table = replace(target, text=head, head=head, modifiers=(), concrete=True)
    note = f"which part of the {head} is not aimed at"
    return replace(
        command, target=table, relation=Relation.ON, primitive=Primitive.PUT_ON, notes=(*command.notes, note)
    )
