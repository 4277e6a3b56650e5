# SPDX-License-Identifier: Apache-2.0
"""Clauses of the grammar to what they ask for: which thing, which action, which place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import lark

from uncom_language.parser.lexical.lexicon import Lexicon
from uncom_language.parser.lexical.tokens import Token
from uncom_language.parser.syntax.clause import NEEDS_TARGET, Clause
from uncom_language.parser.syntax.grammar import NotInGrammarError, Tree, children
from uncom_language.parser.syntax.locative_phrases import SUPPORTING, LocativePhrase, WordTiming, attach_phrases
from uncom_language.parser.syntax.reference_builder import ReferenceBuilder, tokens_of
from uncom_language.types import Reference, Relation, Span

# These verbs never take a place to go to: what follows tells which thing is meant.
_NO_TARGET = frozenset({"take", "give", "point"})
_SPOTS = frozenset({"located", "between", "side", "here", "moved"})


@dataclass(slots=True)
class _Parts:
    """Children of a clause: what stands before the things, behind them, and behind "should go"."""

    verbs: list[Token] = field(default_factory=list)
    things: list[Reference] = field(default_factory=list)
    leading: list[LocativePhrase] = field(default_factory=list)
    following: list[LocativePhrase] = field(default_factory=list)
    gone: list[LocativePhrase] = field(default_factory=list)


class ClauseReader:
    """Reads the clauses of one utterance."""

    def __init__(self, lexicon: Lexicon, timing: WordTiming) -> None:
        """Keep the lexicon and the words' times."""
        self._lexicon = lexicon
        self._timing = timing
        self._build = ReferenceBuilder(lexicon, timing)
        self._kind_before = ""

    def read(self, tree: Tree) -> Clause:
        """Read one clause.

        Raises:
            NotInGrammarError: words in an order that makes no sense.
        """
        if tree.data == "topic":
            return self._read_topic(tree)
        parts = self._parts(children(tree))
        kind, release = self._kind(parts.verbs)
        # A participle says more than "should be": "should be stacked on".
        named = [token for token in parts.verbs if token.tag in ("VERB", "PARTICIPLE", "PARTICLE")]
        action = named or parts.verbs
        targets, nested = self._split(kind or self._kind_before, parts)
        if kind == "take" and any(place.directed for place in targets):
            kind = "put"
        if kind == "put" and not targets and any(p.kind == "recipient" for p in (*parts.leading, *parts.following)):
            kind = "give"  # "bring that box to me"
        if kind == "pour" and not parts.things:
            parts.things.extend(thing for place in nested if place.tokens[0].tag == "SOURCE" for thing in place.things)
            nested = []
        self._check(kind, parts, targets)
        objects = _without_both(parts.things)
        if not objects and nested and not kind and not targets:
            objects = (self._build.anything(nested[0]),)  # "not the red one"
        if not objects and release and not targets:
            objects = (self._build.held(action),)
        if kind in NEEDS_TARGET and not targets and not release and nested and nested[-1].relation == "with":
            targets, nested = [replace(nested[-1], kind="located", relation="near")], nested[:-1]  # "with the lemon"
        targets, excluded = _exclusions_of_object(objects, targets)
        nested = [*nested, *excluded]
        if objects and nested:
            objects = (*objects[:-1], attach_phrases(objects[-1], nested, self._timing))
        clause = Clause(
            order=self._order(tree, kind, parts.things),
            kind=kind,
            action_text=" ".join(token.text for token in action),
            action_span=self._timing.of(action) if action else None,
            objects=objects,
            release=release,
            tokens=tokens_of(tree),
            excludes=any(place.kind == "excepted" for place in parts.leading),
            distance_m=next((p.distance_m for p in (*targets, *nested) if p.distance_m), 0.0),
        )
        self._kind_before = kind or self._kind_before
        return self._with_way(self._with_target(clause, [place for place in targets if place.kind != "moved"]), action)

    def _read_topic(self, tree: Tree) -> Clause:
        """Read "this cup here, put it on that plate"."""
        parts = children(tree)
        verb = next(i for i, part in enumerate(parts) if isinstance(part, lark.Token))
        topic = self._parts(parts[:verb])
        objects = tuple(topic.things)
        objects = (*objects[:-1], attach_phrases(objects[-1], topic.following, self._timing))
        rest = lark.Tree("active", parts[verb:])
        return replace(self.read(rest), topic=objects)

    def _parts(self, nodes: Sequence[Tree | lark.Token]) -> _Parts:
        """Collect verb tokens, things and places in spoken order."""
        parts = _Parts()
        for node in nodes:
            if isinstance(node, lark.Token) or node.data in ("particles", "done"):
                parts.verbs.extend(tokens_of(node))
                continue
            if node.data == "things":
                parts.things.extend(self._things(node))
                continue
            going = any(token.tag == "GOING" for token in parts.verbs)
            places = self._build.places(node) if node.data == "places" else (self._build.place(node),)
            (parts.leading if not parts.things else parts.gone if going else parts.following).extend(places)
        return parts

    def _things(self, tree: Tree) -> list[Reference]:
        """Read things in a row; "the cup, the red one" is one thing."""
        things: list[Reference] = []
        joined = ""
        for node in children(tree):
            if isinstance(node, lark.Token):
                joined = tokens_of(node)[0].text
                continue
            thing = self._build.thing(node)
            apposed = joined == "." and thing.head in self._lexicon.raw["ones"] and not thing.deictic
            if apposed and things[-1].concrete and len(things) == 1:
                span = Span(things[-1].span.start_s, thing.span.end_s)
                extra = replace(thing, text=" ".join([*thing.modifiers, things[-1].text]), head=things[-1].head)
                modifiers = (*things[-1].modifiers, *thing.modifiers)
                things[-1] = replace(extra, span=span, modifiers=modifiers, concrete=True, order=things[-1].order)
            else:
                things.append(thing)
        return things

    def _kind(self, verbs: Sequence[Token]) -> tuple[str, bool]:
        """Return the kind of action, and whether it lets go of what is held."""
        named = [token for token in verbs if token.tag in ("VERB", "PARTICIPLE")]
        if not named:
            return ("put" if verbs else ""), False
        verb = named[-1]
        ways = {token.text for token in verbs if token.tag == "PARTICLE"}
        return verb.value, verb.text in self._lexicon.releases or (
            verb.value == "put" and bool(ways & self._lexicon.put_down)
        )

    def _check(self, kind: str, parts: _Parts, targets: Sequence[LocativePhrase]) -> None:
        """Reject what only looks like a command: "bring me to the station"."""
        first = parts.verbs[0] if parts.verbs else None
        if first is not None and kind == "give" and not parts.things and any(place.things for place in targets):
            raise NotInGrammarError(targets[0].tokens[0], ("NOUN",))

    def _order(self, tree: Tree, kind: str, things: Sequence[Reference]) -> str:
        """Return what is ordered rather than pointed out: a drink, or with "I want" what has unknown words."""
        if kind not in ("want", "give", "take") or not things:
            return ""
        definite = any(
            token.tag in ("DEICTIC", "PRONOUN", "SAME") or token.text in self._lexicon.definite
            for token in tokens_of(tree)
        )
        sort = self._lexicon.noun_class.get(things[0].head, "unknown")
        strange = any(token.tag == "NOUN" and token.detail.startswith("unknown") for token in tokens_of(tree))
        if definite or not (sort == "drink" or (kind == "want" and (sort == "unknown" or strange))):
            return ""
        return things[0].text

    def _split(self, kind: str, parts: _Parts) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
        """Tell where the thing is to go from which thing is meant: (target and what hangs on it, the object's own)."""
        leading, following, gone = ([p for p in places if p.kind != "recipient"] for places in _chains(parts))
        # "not the red one", "similar to this": these tell which thing, wherever they stand
        excluded = list(takewhile(lambda place: place.kind not in _SPOTS, leading))
        leading = leading[len(excluded) :]
        if gone:
            return gone, following
        if leading and parts.things:
            return leading, [*excluded, *following]
        if leading and kind == "pour":
            return self._split_chain(kind, [], leading)  # "pour from the bottle into the cup"
        if leading:
            return leading, excluded
        if not kind:  # a fragment tells which thing, not where to
            return [], [*excluded, *following]
        if any(place.kind in _SPOTS for place in following):  # "not on the plate but in the bowl"
            following = [p for p in following if p.kind != "excepted" or p.things or p.tokens[0].tag != "NOT"]
        targets, nested = self._split_chain(kind, parts.things, following)
        return targets, [*excluded, *nested]

    def _split_chain(
        self, kind: str, things: list[Reference], places: list[LocativePhrase]
    ) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
        """Split the phrases behind a thing."""
        free = [
            index
            for index, place in enumerate(places)
            if not place.restrictive
            and not _belongs_to_with(places, index)
            and (kind not in _NO_TARGET or (place.directed and place.kind == "located" and kind == "take"))
        ]
        if kind == "take" and things and things[-1].deictic and places and places[-1].kind == "here":
            free = [len(places) - 1]  # "take this cup over there": the place is where to
        if not free:
            return [], places
        start = _target_start(places, free)
        return places[start:], places[:start]

    def _with_target(self, clause: Clause, places: list[LocativePhrase]) -> Clause:
        if not places:
            return clause
        first, rest = places[0], places[1:]
        if first.kind == "here":
            return replace(clause, target=self._build.area(first), relation=Relation(first.relation))
        if first.kind == "side":
            # "to the left, next to the cup": the thing is where to
            located = next((i for i, place in enumerate(rest) if place.kind in ("located", "between", "here")), None)
            if located is not None:
                return self._with_target(clause, rest[located:])
            return replace(clause, relation=Relation(first.relation))
        return self._with_thing(clause, first, rest) if first.things else clause

    def _with_thing(self, clause: Clause, first: LocativePhrase, rest: Sequence[LocativePhrase]) -> Clause:
        *others, last = first.things
        last = attach_phrases(last, rest, self._timing)
        to_somewhere = clause.kind == "push" and first.tokens[0].tag == "TO"  # nobody pushes a thing into another
        relation = Relation.NEAR if to_somewhere else Relation(first.relation)
        if relation is Relation.BETWEEN and others:
            return replace(clause, target=others[0], reference2=last, relation=relation)
        if relation is Relation.BETWEEN and last.quantity == 1 and not rest:
            clause = replace(clause, lacks="target")
        if last.head in self._lexicon.place_nouns and last.deictic:
            here = last.deictic in ("this", "these")
            relation = Relation.HERE if here else Relation.THERE
        return replace(clause, target=last, relation=relation)

    def _with_way(self, clause: Clause, action: Sequence[Token]) -> Clause:
        """Read "push it away"."""
        if clause.kind != "push" or clause.placed:
            return clause
        ways = self._lexicon.ways
        way = next((ways[token.value] for token in action if token.tag == "PARTICLE" and token.value in ways), None)
        return replace(clause, relation=Relation(way)) if way is not None else clause


def _chains(parts: _Parts) -> tuple[list[LocativePhrase], list[LocativePhrase], list[LocativePhrase]]:
    return parts.leading, parts.following, parts.gone


def _belongs_to_with(places: Sequence[LocativePhrase], index: int) -> bool:
    """Whether a phrase is the end of "the plate with the lemon on it"."""
    if index == 0 or not (places[index].things and places[index].things[0].anaphoric):
        return False
    before = places[index - 1]
    return before.kind == "compared" and before.relation == "with"


def _exclusions_of_object(
    things: Sequence[Reference], targets: Sequence[LocativePhrase]
) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
    """Take "except the green one" from the end of the target, unless it repeats the target's noun."""
    heads = {thing.head for place in targets if place.kind != "excepted" for thing in place.things}
    heads -= {thing.head for thing in things}
    mine = [
        place
        for place in targets
        if place.kind == "excepted" and things and not any(thing.head in heads for thing in place.things)
    ]
    return [place for place in targets if place not in mine], mine


def _without_both(things: Sequence[Reference]) -> tuple[Reference, ...]:
    """Let "both the apple and the pear" be one of each."""
    if [thing.quantity for thing in things] == [2, 1]:
        return (replace(things[0], quantity=1), things[1])
    return tuple(things)


def _target_start(places: list[LocativePhrase], free: list[int]) -> int:
    """Return which phrase of a chain says where to.

    "the cup next to the bottle on the plate": the last supporting phrase (in, on) is where things go and what
    stands before it tells which thing; without one the first phrase is it, but "on the left" tells which thing if
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
    telling = [index for index in free if places[index].kind == "side" and not places[index].directed]
    going = [index for index in free if index not in telling]
    going = [index for index in going if places[index].toward] or going
    return going[0] if going else free[-1]
