# SPDX-License-Identifier: Apache-2.0
"""How long to wait for more words: less, when those said are a whole command."""

from __future__ import annotations

from uncom_common.primitive import Primitive

from uncom_language.parser.grammar_parser import load_parser, parse_text
from uncom_language.types import Act, Command, Reference, Relation

_COMPLETE_ACTS = frozenset({Act.STOP, Act.CANCEL, Act.YES})


def end_of_turn_pause_s(words: str, complete_pause_s: float, incomplete_pause_s: float, language: str = "en") -> float:
    """Return the pause [s] after which an utterance of these words is over.

    Args:
        words: heard so far.
        complete_pause_s: after a command that lacks nothing.
        incomplete_pause_s: after words that are no command yet.
        language: language pack.
    """
    if not words:
        return incomplete_pause_s
    ones = load_parser(language).lexicon.ones
    return (
        incomplete_pause_s
        if any(_is_likely_continued(command, ones) for command in parse_text(words, language))
        else complete_pause_s
    )


def _is_likely_continued(command: Command, ones: frozenset[str]) -> bool:
    """Whether more words are likely to belong to a command."""
    if command.act in _COMPLETE_ACTS:
        return False
    if command.act is not Act.COMMAND:
        return True
    last = command.reference2 or command.target or command.object
    if last is None or _lacks_noun(last, ones):
        return True
    if command.target is None and command.relation is not Relation.NONE:
        return True  # "to the left" may go on with "of the box"
    if command.primitive in (Primitive.PICK, Primitive.PUSH) and command.target is None:
        return True  # "take the lemon" is whole and yet mostly goes on with "and put it ..."
    # A pointing word alone may still get its noun.
    return bool(last.deictic) and last.text == last.deictic and command.relation not in (Relation.HERE, Relation.THERE)


def _lacks_noun(reference: Reference, ones: frozenset[str]) -> bool:
    """Whether a noun seems to be missing: "the red", "the second"."""
    named = reference.concrete or reference.deictic or reference.anaphoric
    return not named and reference.head not in ones and not reference.anchor
