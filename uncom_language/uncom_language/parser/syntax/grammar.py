# SPDX-License-Identifier: Apache-2.0
"""The grammar file of a language pack as a parser over tagged words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

import lark
from lark.lexer import Lexer

from uncom_language.parser.lexical.lexicon import PACKS
from uncom_language.parser.lexical.tokens import Token

Tree = lark.Tree


def children(tree: Tree) -> list[Any]:
    """Return the subtrees and terminals of a tree."""
    return list(tree.children)


class NotInGrammarError(ValueError):
    """The tokens are no sentence of the grammar; holds the token that does not fit and the classes that would."""

    def __init__(self, token: Token | None, expected: Iterable[str]) -> None:
        """Say which token does not fit (None: the sentence ends too early), and which classes would."""
        self.token = token
        self.expected = frozenset(expected)
        super().__init__(f"unexpected {token.text!r}" if token else "the sentence ends too early")


class _TokenStream(Lexer):
    """Passes tagged words on as terminals; each terminal carries its Token as value."""

    def __init__(self, lexer_conf: Any) -> None:
        """Take Lark's configuration, of which nothing is needed."""

    def lex(self, data: Iterable[Token]) -> Iterator[lark.Token]:
        """Yield one terminal a token."""
        for token in data:
            yield lark.Token(token.tag, token)


@cache
def load_grammar(language: str) -> lark.Lark:
    """Compile the grammar of a language pack (LALR: linear time)."""
    text = (PACKS / language / "grammar.lark").read_text(encoding="utf-8")
    return lark.Lark(text, parser="lalr", lexer=_TokenStream)


def parse_tokens(tokens: list[Token], language: str) -> Tree:
    """Parse tagged words.

    Raises:
        NotInGrammarError: they are no sentence.
    """
    try:
        return load_grammar(language).parse(tokens)  # type: ignore[arg-type]
    except lark.UnexpectedToken as error:
        misfit: Any = error
        token = misfit.token.value if isinstance(misfit.token.value, Token) else None
        raise NotInGrammarError(token, misfit.accepts or misfit.expected) from error
