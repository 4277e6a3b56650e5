# SPDX-License-Identifier: Apache-2.0
"""Clauses of the grammar to what they ask for: which object, which action, which place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import lark

from uncom_language.parser.lexical.lexicon import Lexicon
from uncom_language.parser.lexical.tokens import Token
from uncom_language.parser.syntax.clause import NEEDS_TARGET, Clause
from uncom_language.parser.syntax.grammar import NotInGrammarError, Tree, children
from uncom_language.parser.syntax.locative_phrases import LocativePhrase, WordTiming, attach_phrases
from uncom_language.parser.syntax.reference_builder import ReferenceBuilder, tokens_of
from uncom_language.parser.syntax.target_phrases import ends_with_phrase, find_target_start, split_exclusions
from uncom_language.types import Reference, Relation, Span

# These verbs never take a place to go to: what follows tells which object is meant.
_VERBS_WITHOUT_TARGET = frozenset({"take", "give", "point"})
_TARGET_KINDS = frozenset({"located", "between", "side", "here", "moved"})


@dataclass(slots=True)
class _Parts:
    """Children of a clause: what stands before the objects, behind them, and behind "should go"."""

    verbs: list[Token] = field(default_factory=list)
    references: list[Reference] = field(default_factory=list)
    leading: list[LocativePhrase] = field(default_factory=list)
    following: list[LocativePhrase] = field(default_factory=list)
    destinations: list[LocativePhrase] = field(default_factory=list)


class ClauseReader:
    """Reads the clauses of one utterance."""

    def __init__(self, lexicon: Lexicon, timing: WordTiming) -> None:
        """Take the words of the language and the times of those that were said."""
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
        targets, nested = self._split_phrases(kind or self._kind_before, parts)
        if kind == "take" and any(place.directed for place in targets):
            kind = "put"
        if kind == "put" and not targets and any(p.kind == "recipient" for p in (*parts.leading, *parts.following)):
            kind = "give"  # "bring that box to me"
        if kind == "pour" and not parts.references:
            parts.references.extend(
                reference for place in nested if place.tokens[0].tag == "SOURCE" for reference in place.references
            )
            nested = []
        self._reject_non_command(kind, parts, targets)
        objects = _resolve_both(parts.references)
        if not objects and nested and not kind and not targets:
            objects = (self._build.unnamed(nested[0]),)  # "not the red one"
        if not objects and release and not targets:
            objects = (self._build.held(action),)
        if kind in NEEDS_TARGET and not targets and not release and nested and nested[-1].relation == "with":
            targets, nested = [replace(nested[-1], kind="located", relation="near")], nested[:-1]  # "with the lemon"
        targets, excluded = split_exclusions(objects, targets)
        nested = [*nested, *excluded]
        if objects and nested:
            objects = (*objects[:-1], attach_phrases(objects[-1], nested, self._timing))
        clause = Clause(
            order=self._ordered_item(tree, kind, parts.references),
            kind=kind,
            action_text=" ".join(token.text for token in action),
            action_span=self._timing.of(action) if action else None,
            objects=objects,
            release=release,
            tokens=tokens_of(tree),
            is_exclusion=any(place.kind == "excepted" for place in parts.leading),
            distance_m=next((p.distance_m for p in (*targets, *nested) if p.distance_m), 0.0),
        )
        self._kind_before = kind or self._kind_before
        return self._with_direction(
            self._with_target(clause, [place for place in targets if place.kind != "moved"]), action
        )

    def _read_topic(self, tree: Tree) -> Clause:
        """Read "this cup here, put it on that plate"."""
        parts = children(tree)
        verb = next(i for i, part in enumerate(parts) if isinstance(part, lark.Token))
        topic = self._parts(parts[:verb])
        objects = tuple(topic.references)
        objects = (*objects[:-1], attach_phrases(objects[-1], topic.following, self._timing))
        rest = lark.Tree("active", parts[verb:])
        return replace(self.read(rest), topic=objects)

    def _parts(self, nodes: Sequence[Tree | lark.Token]) -> _Parts:
        """Collect verb tokens, objects and places in spoken order."""
        parts = _Parts()
        for node in nodes:
            if isinstance(node, lark.Token) or node.data in ("particles", "done"):
                parts.verbs.extend(tokens_of(node))
                continue
            if node.data == "noun_phrases":
                parts.references.extend(self._references(node))
                continue
            going = any(token.tag == "GOING" for token in parts.verbs)
            places = self._build.places(node) if node.data == "places" else (self._build.place(node),)
            (parts.leading if not parts.references else parts.destinations if going else parts.following).extend(places)
        return parts

    def _references(self, tree: Tree) -> list[Reference]:
        """Read objects in a row; "the cup, the red one" is one object."""
        references: list[Reference] = []
        joined = ""
        for node in children(tree):
            if isinstance(node, lark.Token):
                joined = tokens_of(node)[0].text
                continue
            reference = self._build.reference(node)
            apposed = joined == "." and reference.head in self._lexicon.raw["ones"] and not reference.deictic
            if apposed and references[-1].concrete and len(references) == 1:
                span = Span(references[-1].span.start_s, reference.span.end_s)
                extra = replace(
                    reference, text=" ".join([*reference.modifiers, references[-1].text]), head=references[-1].head
                )
                modifiers = (*references[-1].modifiers, *reference.modifiers)
                references[-1] = replace(
                    extra, span=span, modifiers=modifiers, concrete=True, order=references[-1].order
                )
            else:
                references.append(reference)
        return references

    def _kind(self, verbs: Sequence[Token]) -> tuple[str, bool]:
        """Return the kind of action, and whether it lets go of what is held."""
        named = [token for token in verbs if token.tag in ("VERB", "PARTICIPLE")]
        if not named:
            return ("put" if verbs else ""), False
        verb = named[-1]
        particles = {token.text for token in verbs if token.tag == "PARTICLE"}
        return verb.value, verb.text in self._lexicon.releases or (
            verb.value == "put" and bool(particles & self._lexicon.put_down)
        )

    def _reject_non_command(self, kind: str, parts: _Parts, targets: Sequence[LocativePhrase]) -> None:
        """Reject what only looks like a command: "bring me to the station"."""
        first = parts.verbs[0] if parts.verbs else None
        if first is not None and kind == "give" and not parts.references and any(place.references for place in targets):
            raise NotInGrammarError(targets[0].tokens[0], ("NOUN",))

    def _ordered_item(self, tree: Tree, kind: str, references: Sequence[Reference]) -> str:
        """Return what is ordered rather than pointed out: a drink, or with "I want" what has unknown words."""
        if kind not in ("want", "give", "take") or not references:
            return ""
        definite = any(
            token.tag in ("DEICTIC", "PRONOUN", "SAME") or token.text in self._lexicon.definite
            for token in tokens_of(tree)
        )
        sort = self._lexicon.noun_class.get(references[0].head, "unknown")
        has_unknown_noun = any(token.tag == "NOUN" and token.detail.startswith("unknown") for token in tokens_of(tree))
        if definite or not (sort == "drink" or (kind == "want" and (sort == "unknown" or has_unknown_noun))):
            return ""
        return references[0].text

    def _split_phrases(self, kind: str, parts: _Parts) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
        """Return the phrases that say where the object is to go, and those that say which object is meant."""
        leading, following, destinations = (
            [p for p in places if p.kind != "recipient"] for places in _locative_chains(parts)
        )
        # "not the red one", "similar to this": these tell which object, wherever they stand
        excluded = list(takewhile(lambda place: place.kind not in _TARGET_KINDS, leading))
        leading = leading[len(excluded) :]
        if destinations:
            return destinations, following
        if leading and parts.references:
            return leading, [*excluded, *following]
        if leading and kind == "pour":
            return self._split_chain(kind, [], leading)  # "pour from the bottle into the cup"
        if leading:
            return leading, excluded
        if not kind:  # a fragment tells which object, not where to
            return [], [*excluded, *following]
        if any(place.kind in _TARGET_KINDS for place in following):  # "not on the plate but in the bowl"
            following = [p for p in following if p.kind != "excepted" or p.references or p.tokens[0].tag != "NOT"]
        targets, nested = self._split_chain(kind, parts.references, following)
        return targets, [*excluded, *nested]

    def _split_chain(
        self, kind: str, references: list[Reference], places: list[LocativePhrase]
    ) -> tuple[list[LocativePhrase], list[LocativePhrase]]:
        """Split the phrases behind an object."""
        free = [
            index
            for index, place in enumerate(places)
            if not place.restrictive
            and not ends_with_phrase(places, index)
            and (kind not in _VERBS_WITHOUT_TARGET or (place.directed and place.kind == "located" and kind == "take"))
        ]
        if kind == "take" and references and references[-1].deictic and places and places[-1].kind == "here":
            free = [len(places) - 1]  # "take this cup over there": the place is where to
        if not free:
            return [], places
        start = find_target_start(places, free)
        return places[start:], places[:start]

    def _with_target(self, clause: Clause, places: list[LocativePhrase]) -> Clause:
        if not places:
            return clause
        first, rest = places[0], places[1:]
        if first.kind == "here":
            return replace(clause, target=self._build.area(first), relation=Relation(first.relation))
        if first.kind == "side":
            # "to the left, next to the cup": the object is where to
            located = next((i for i, place in enumerate(rest) if place.kind in ("located", "between", "here")), None)
            if located is not None:
                return self._with_target(clause, rest[located:])
            return replace(clause, relation=Relation(first.relation))
        return self._with_target_phrase(clause, first, rest) if first.references else clause

    def _with_target_phrase(self, clause: Clause, first: LocativePhrase, rest: Sequence[LocativePhrase]) -> Clause:
        *others, last = first.references
        last = attach_phrases(last, rest, self._timing)
        is_destination = clause.kind == "push" and first.tokens[0].tag == "TO"  # nobody pushes an object into another
        relation = Relation.NEAR if is_destination else Relation(first.relation)
        if relation is Relation.BETWEEN and others:
            return replace(clause, target=others[0], reference2=last, relation=relation)
        if relation is Relation.BETWEEN and last.quantity == 1 and not rest:
            clause = replace(clause, unfinished_part="target")
        if last.head in self._lexicon.place_nouns and last.deictic:
            here = last.deictic in ("this", "these")
            relation = Relation.HERE if here else Relation.THERE
        return replace(clause, target=last, relation=relation)

    def _with_direction(self, clause: Clause, action: Sequence[Token]) -> Clause:
        """Read "push it away"."""
        if clause.kind != "push" or clause.placed:
            return clause
        directions = self._lexicon.push_directions
        direction = next(
            (directions[token.value] for token in action if token.tag == "PARTICLE" and token.value in directions), None
        )
        return replace(clause, relation=Relation(direction)) if direction is not None else clause


def _locative_chains(parts: _Parts) -> tuple[list[LocativePhrase], list[LocativePhrase], list[LocativePhrase]]:
    return parts.leading, parts.following, parts.destinations


def _resolve_both(references: Sequence[Reference]) -> tuple[Reference, ...]:
    """Let "both the apple and the pear" be one of each."""
    if [reference.quantity for reference in references] == [2, 1]:
        return (replace(references[0], quantity=1), references[1])
    return tuple(references)
