# SPDX-License-Identifier: Apache-2.0
"""Where one clause ends and the next begins: what "and", commas and full stops join."""

from __future__ import annotations

from dataclasses import replace

from uncom_language.parser.lexical.tokens import OBJECT_TAGS, Token

_PLACE_OR_RECIPIENT_TAGS = frozenset({"RELATION", "TO", "SOURCE", "BETWEEN", "SIDE", "PLACE", "RECIPIENT"})
_CONJUNCTION_TAGS = frozenset({"AND", "CLAUSE_AND", "THEN"})
_OBJECT_END_TAGS = frozenset({"NOUN", "ONE", "PRONOUN", "DEICTIC", "PLACE", "SIDE", "OTHER", "ADJECTIVE"})


def resolve_conjunctions(tokens: list[Token], stops: set[int], commas: set[int]) -> list[Token]:
    """Tell an "and" between clauses from one between objects, and put joins where none is spoken.

    Args:
        tokens: of one utterance; each "and" has the class AND.
        stops: indices of words that a full stop follows.
        commas: indices of words that a comma follows.
    """
    resolved: list[Token] = []
    clause = _ClauseState()
    for position, spoken in enumerate(tokens):
        token = spoken
        made = _unspoken_conjunction(resolved, token, clause, stops, commas)
        if made:
            resolved.append(Token(made, ".", ".", resolved[-1].last, resolved[-1].last))
            clause = clause.after(made)
        following = tokens[position + 1].tag if position + 1 < len(tokens) else ""
        if token.tag == "TO" and following == "VERB":
            continue  # "... and to put it there"
        if token.tag == "AND":
            token = replace(token, tag=_conjunction_tag(following, clause))
        elif token.tag == "EXCEPT" and following == "VERB":
            token = replace(token, tag="CLAUSE_AND")  # "but put it there"
        clause = clause.after(token.tag)
        resolved.append(token)
    while resolved and resolved[-1].tag in _CONJUNCTION_TAGS:
        resolved.pop()
    return resolved


class _ClauseState:
    """What the clause has had so far."""

    def __init__(self, verb: bool = False, place: bool = False, between: bool = False, reference: bool = False) -> None:
        self.verb, self.place, self.between, self.reference = verb, place, between, reference

    def after(self, tag: str) -> _ClauseState:
        """Return what it has had after a token."""
        if tag in ("CLAUSE_AND", "THEN"):
            return _ClauseState()
        return _ClauseState(
            self.verb or tag == "VERB",
            self.place or tag in _PLACE_OR_RECIPIENT_TAGS,
            (self.between or tag == "BETWEEN") and tag != "AND",
            self.reference or tag in OBJECT_TAGS,
        )


def _unspoken_conjunction(
    resolved: list[Token], token: Token, clause: _ClauseState, stops: set[int], commas: set[int]
) -> str:
    """Return the join that is not spoken between two tokens; empty if there is none."""
    if not resolved or resolved[-1].tag in _CONJUNCTION_TAGS or token.tag in _CONJUNCTION_TAGS:
        return ""
    before = resolved[-1]
    if any(before.last <= stop < token.first for stop in stops):
        return "THEN"
    if token.tag == "VERB" and clause.verb and (clause.reference or clause.place):
        return "CLAUSE_AND"  # "take the lemon put it in the bowl"
    if token.tag == before.tag == "DEICTIC":
        return "AND"  # "this, this and this"
    comma = any(before.last <= index < token.first for index in commas)
    if comma and clause.verb and token.tag in OBJECT_TAGS and before.tag in _OBJECT_END_TAGS:
        return "CLAUSE_AND" if clause.place else "AND"  # "the fork, the knife and the spoon"
    return ""


def _conjunction_tag(following: str, clause: _ClauseState) -> str:
    if following in ("VERB", "THEN", "") or (following in _PLACE_OR_RECIPIENT_TAGS and not clause.between):
        return "CLAUSE_AND"
    if clause.between:
        return "AND"
    return "CLAUSE_AND" if clause.place else "AND"
