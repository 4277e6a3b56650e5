# SPDX-License-Identifier: Apache-2.0
"""How long to wait for more words: less, when those said are a whole command."""

from __future__ import annotations

from uncom_language.parser.commands import grammar_parser, parse_text
from uncom_language.types import Act, Command, Primitive, Reference, Relation

# "Take the lemon" is whole and yet mostly goes on with "and put it ..."; a pointing word alone may still get its noun.
_MIDDLE = 1.0
_AT_ONCE = frozenset({Act.STOP, Act.CANCEL, Act.YES})


def patience_s(words: str, quick_s: float, full_s: float, language: str = "en") -> float:
    """Return the pause [s] after which an utterance of these words is over.

    Args:
        words: heard so far.
        quick_s: after a command that lacks nothing.
        full_s: after words that are no command yet.
        language: language pack.
    """
    if not words:
        return full_s
    commands = parse_text(words, language)
    waits = [_share(command, grammar_parser(language).lexicon.ones) for command in commands]
    return quick_s + (full_s - quick_s) * max(waits)


def _share(command: Command, ones: frozenset[str]) -> float:
    """Return 0 to end at once, 1 to wait in full."""
    if command.act in _AT_ONCE:
        return 0.0
    if command.act is not Act.COMMAND:
        return 1.0
    last = command.reference2 or command.target or command.object
    if last is None or _half_said(last, ones):
        return 1.0
    if command.target is None and command.relation is not Relation.NONE:
        return 1.0  # "to the left" may go on with "of the box"
    if command.primitive in (Primitive.PICK, Primitive.PUSH) and command.target is None:
        return _MIDDLE
    bare = last.deictic and last.text == last.deictic and command.relation not in (Relation.HERE, Relation.THERE)
    return _MIDDLE if bare else 0.0


def _half_said(reference: Reference, ones: frozenset[str]) -> bool:
    """Whether a noun seems to be missing: "the red", "the second"."""
    named = reference.concrete or reference.deictic or reference.anaphoric
    return not named and reference.head not in ones and not reference.anchor
