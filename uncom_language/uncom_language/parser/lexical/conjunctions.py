# SPDX-License-Identifier: Apache-2.0
"""Where one clause ends and the next begins: what "and", commas and full stops join."""

from __future__ import annotations

from dataclasses import replace

from uncom_language.parser.lexical.tokens import PREMODIFIERS, Token

_PLACES = frozenset({"RELATION", "TO", "SOURCE", "BETWEEN", "SIDE", "PLACE", "RECIPIENT"})
_JOINS = frozenset({"AND", "CLAUSE_AND", "THEN"})
_THING_START = PREMODIFIERS | {"NOUN", "ONE", "PRONOUN"}
_THING_END = frozenset({"NOUN", "ONE", "PRONOUN", "DEICTIC", "PLACE", "SIDE", "OTHER", "ADJECTIVE"})


def resolve_conjunctions(tokens: list[Token], stops: set[int], commas: set[int]) -> list[Token]:
    """Tell an "and" between clauses from one between things, and put joins where none is spoken.

    Args:
        tokens: of one utterance; each "and" has the class AND.
        stops: indices of words that a full stop follows.
        commas: indices of words that a comma follows.
    """
    settled: list[Token] = []
    clause = _Clause()
    for position, spoken in enumerate(tokens):
        token = spoken
        made = _silent_join(settled, token, clause, stops, commas)
        if made:
            settled.append(Token(made, ".", ".", settled[-1].last, settled[-1].last))
            clause = clause.after(made)
        following = tokens[position + 1].tag if position + 1 < len(tokens) else ""
        if token.tag == "TO" and following == "VERB":
            continue  # "... and to put it there"
        if token.tag == "AND":
            token = replace(token, tag=_join_tag(following, clause))
        elif token.tag == "EXCEPT" and following == "VERB":
            token = replace(token, tag="CLAUSE_AND")  # "but put it there"
        clause = clause.after(token.tag)
        settled.append(token)
    while settled and settled[-1].tag in _JOINS:
        settled.pop()
    return settled


class _Clause:
    """What the clause has had so far."""

    def __init__(self, verb: bool = False, place: bool = False, between: bool = False, thing: bool = False) -> None:
        self.verb, self.place, self.between, self.thing = verb, place, between, thing

    def after(self, tag: str) -> _Clause:
        """Return what it has had after a token."""
        if tag in ("CLAUSE_AND", "THEN"):
            return _Clause()
        return _Clause(
            self.verb or tag == "VERB",
            self.place or tag in _PLACES,
            (self.between or tag == "BETWEEN") and tag != "AND",
            self.thing or tag in _THING_START,
        )


def _silent_join(settled: list[Token], token: Token, clause: _Clause, stops: set[int], commas: set[int]) -> str:
    """Return the join that is not spoken between two tokens; empty if there is none."""
    if not settled or settled[-1].tag in _JOINS or token.tag in _JOINS:
        return ""
    before = settled[-1]
    if any(before.last <= stop < token.first for stop in stops):
        return "THEN"
    if token.tag == "VERB" and clause.verb and (clause.thing or clause.place):
        return "CLAUSE_AND"  # "take the lemon put it in the bowl"
    if token.tag == before.tag == "DEICTIC":
        return "AND"  # "this, this and this"
    comma = any(before.last <= index < token.first for index in commas)
    if comma and clause.verb and token.tag in _THING_START and before.tag in _THING_END:
        return "CLAUSE_AND" if clause.place else "AND"  # "the fork, the knife and the spoon"
    return ""


def _join_tag(following: str, clause: _Clause) -> str:
    if following in ("VERB", "THEN", "") or (following in _PLACES and not clause.between):
        return "CLAUSE_AND"
    if clause.between:
        return "AND"
    return "CLAUSE_AND" if clause.place else "AND"
