# SPDX-License-Identifier: Apache-2.0
"""What one clause asks for."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.primitive import Primitive

from uncom_language.parser.lexical.tokens import Token
from uncom_language.types import Reference, Relation, Span

_PRIMITIVE_OF_VERB = {
    "stack": Primitive.STACK,
    "pour": Primitive.POUR,
    "push": Primitive.PUSH,
    "give": Primitive.GIVE,
    "point": Primitive.POINT,
    "take": Primitive.PICK,
}
NEEDS_TARGET = frozenset({"put", "pour"})


@dataclass(frozen=True, slots=True)
class Clause:
    """One clause read on its own."""

    kind: str  # of verb; empty: a fragment without one
    action_text: str
    action_span: Span | None
    objects: tuple[Reference, ...]
    target: Reference | None = None
    reference2: Reference | None = None
    relation: Relation = Relation.NONE
    release: bool = False
    tokens: tuple[Token, ...] = ()
    order: str = ""  # what is ordered as from a bar: "a mocha"
    topic: tuple[Reference, ...] = ()  # "this cup, put it there"
    distance_m: float = 0.0
    unfinished_part: str = ""  # a part that was begun and not said: "put the cup on the"
    is_exclusion: bool = False  # "not the red one, the blue one"

    @property
    def primitive(self) -> Primitive:
        """What the arm is to do."""
        if self.kind in _PRIMITIVE_OF_VERB:
            return _PRIMITIVE_OF_VERB[self.kind]
        if self.kind == "want" and self.relation is Relation.NONE:
            return Primitive.GIVE
        if self.kind in ("put", "want"):
            if self.relation is Relation.IN:
                return Primitive.PUT_IN
            return Primitive.PUT_ON if self.relation is Relation.ON else Primitive.PLACE
        return Primitive.NONE

    @property
    def placed(self) -> bool:
        """Whether a place to go to was said."""
        return self.target is not None or self.relation is not Relation.NONE

    @property
    def missing(self) -> str:
        """The part that is missing: object, action, target or nothing."""
        if not self.kind:
            return "action"
        if not self.objects:
            return "object"
        if self.unfinished_part:
            return self.unfinished_part
        if self.kind in NEEDS_TARGET and not self.placed and not self.release:
            return "target"
        if self.kind == "stack" and not self.placed and len(self.objects) == 1 and self.objects[0].quantity == 1:
            return "target"
        return ""
