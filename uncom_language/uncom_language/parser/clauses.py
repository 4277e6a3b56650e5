# SPDX-License-Identifier: Apache-2.0
"""Clauses of the grammar to what they ask for: which thing, which action, which place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import lark

from uncom_language.parser.grammar import Tree, children
from uncom_language.parser.lexicon import Lexicon
from uncom_language.parser.references import SUPPORTING, Place, ReferenceBuilder, Timing, attach, tokens_of
from uncom_language.parser.tagger import Token
from uncom_language.types import Primitive, Reference, Relation, Span

_WHOLE = {
    "stack": Primitive.STACK,
    "pour": Primitive.POUR,
    "push": Primitive.PUSH,
    "give": Primitive.GIVE,
    "point": Primitive.POINT,
    "take": Primitive.PICK,
}
# These verbs never take a place to go to: what follows tells which thing is meant.
_NO_TARGET = frozenset({"take", "give", "point"})
_NEEDS_TARGET = frozenset({"put", "pour"})


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

    @property
    def primitive(self) -> Primitive:
        """What the arm is to do."""
        if self.kind in _WHOLE:
            return _WHOLE[self.kind]
        if self.kind == "want" and self.relation is Relation.NONE:
            return Primitive.GIVE
        if self.kind in ("put", "want"):
            if self.relation is Relation.IN:
                return Primitive.PUT_IN
            return Primitive.PUT_ON if self.relation is Relation.ON else Primitive.PLACE
        return Primitive.NONE

    @property
    def missing(self) -> str:
        """The part that is missing: object, action, target or nothing."""
        if not self.kind:
            return "action"
        if not self.objects:
            return "object"
        placed = self.target is not None or self.relation is not Relation.NONE
        if self.kind in _NEEDS_TARGET and not placed and not self.release:
            return "target"
        if self.kind == "stack" and not placed and len(self.objects) == 1 and self.objects[0].quantity == 1:
            return "target"
        return ""


class ClauseReader:
    """Reads the clauses of one utterance."""

    def __init__(self, lexicon: Lexicon, timing: Timing) -> None:
        """Keep the lexicon and the words' times."""
        self._lexicon = lexicon
        self._timing = timing
        self._build = ReferenceBuilder(lexicon, timing)

    def read(self, tree: Tree) -> Clause:
        """Read one clause."""
        verbs, things, places = self._parts(tree)
        kind, release = self._kind(verbs)
        # A participle says more than "should be": "should be stacked on".
        action = [token for token in verbs if token.tag in ("VERB", "PARTICIPLE", "PARTICLE")] or verbs
        targets, nested = self._split(kind, things, places)
        if kind == "take" and any(place.directed for place in targets):
            kind = "put"
        objects = tuple(things)
        if objects and nested:
            objects = (*objects[:-1], attach(objects[-1], nested, self._timing))
        clause = Clause(
            order=self._order(tree, kind, things),
            kind=kind,
            action_text=" ".join(token.text for token in action),
            action_span=self._timing.of(action) if action else None,
            objects=objects,
            release=release,
            tokens=tokens_of(tree),
        )
        return self._with_target(clause, targets)

    def _parts(self, tree: Tree) -> tuple[list[Token], list[Reference], list[Place]]:
        """Collect verb tokens, things and places in spoken order."""
        verbs: list[Token] = []
        things: list[Reference] = []
        places: list[Place] = []
        for child in children(tree):
            if isinstance(child, lark.Token) or child.data in ("particles", "done"):
                verbs.extend(tokens_of(child))
            elif child.data == "things":
                things.extend(
                    self._build.thing(grandchild) for grandchild in children(child) if isinstance(grandchild, lark.Tree)
                )
            elif child.data == "places":
                places.extend(self._build.places(child))
            else:
                places.append(self._build.place(child))
        return verbs, things, places

    def _kind(self, verbs: Sequence[Token]) -> tuple[str, bool]:
        """Return the kind of action, and whether it lets go of what is held."""
        named = [token for token in verbs if token.tag in ("VERB", "PARTICIPLE")]
        if not named:
            return ("put" if verbs else ""), False
        verb = named[-1]
        down = any(token.tag == "PARTICLE" and token.text == "down" for token in verbs)
        return verb.value, verb.text in self._lexicon.releases or (verb.value == "put" and down)

    def _order(self, tree: Tree, kind: str, things: Sequence[Reference]) -> str:
        """Return what is ordered rather than pointed out: an indefinite drink, or with "I want" anything unknown."""
        if kind not in ("want", "give", "take") or not things:
            return ""
        definite = any(token.tag in ("DEICTIC", "PRONOUN") or token.text == "the" for token in tokens_of(tree))
        sort = self._lexicon.noun_class.get(things[0].head, "unknown")
        if definite or not (sort == "drink" or (kind == "want" and sort == "unknown")):
            return ""
        return things[0].text

    def _split(self, kind: str, things: list[Reference], places: list[Place]) -> tuple[list[Place], list[Place]]:
        """Tell where the thing is to go from which thing is meant: (target and what hangs on it, the object's own)."""
        places = [place for place in places if place.kind != "recipient"]
        free = [
            index
            for index, place in enumerate(places)
            if not place.restrictive and (kind not in _NO_TARGET or (place.directed and kind == "take"))
        ]
        if kind == "take" and things and things[-1].deictic and places and places[-1].kind == "here":
            free = [len(places) - 1]  # "take this cup over there": the place is where to
        if not free:
            return [], places
        start = _target_start(places, free)
        return places[start:], places[:start]

    def _with_target(self, clause: Clause, places: list[Place]) -> Clause:
        if not places:
            return clause
        first, rest = places[0], places[1:]
        if first.kind == "here":
            return replace(clause, target=self._build.area(first), relation=Relation(first.relation))
        if first.kind == "side":
            return replace(clause, relation=Relation(first.relation))
        *others, last = first.things
        last = attach(last, rest, self._timing)
        relation = Relation(first.relation)
        if relation is Relation.BETWEEN and others:
            return replace(clause, target=others[0], reference2=last, relation=relation)
        if last.head in self._lexicon.place_nouns and last.deictic:
            here = last.deictic in ("this", "these")
            return replace(clause, target=last, relation=Relation.HERE if here else Relation.THERE)
        return replace(clause, target=last, relation=relation)


def _target_start(places: list[Place], free: list[int]) -> int:
    """Return which phrase of a chain says where to.

    "the cup next to the bottle on the plate": the last supporting phrase (in, on) is where things go and what
    stands before it tells which thing; without one the first phrase is it. "Into", "onto" and "to" are always it.
    """
    directed = [index for index in free if places[index].directed]
    if directed:
        return directed[0]
    pointed = [index for index in free if places[index].kind == "here"]
    if pointed and pointed[-1] == len(places) - 1:
        return pointed[-1]
    supporting = [index for index in free if places[index].relation in SUPPORTING]
    return supporting[-1] if supporting else free[0]
