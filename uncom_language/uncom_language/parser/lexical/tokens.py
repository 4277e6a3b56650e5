# SPDX-License-Identifier: Apache-2.0
"""Words as the parser handles them."""

from __future__ import annotations

from dataclasses import dataclass

# What may stand before a noun within its phrase.
PREMODIFIERS = frozenset({"DETERMINER", "DEICTIC", "COUNT", "OTHER", "SAME", "ADJECTIVE"})
# What a noun phrase is made of.
OBJECT_TAGS = PREMODIFIERS | {"NOUN", "ONE", "PRONOUN"}


@dataclass(frozen=True, slots=True)
class Token:
    """A phrase with its class; first and last are word indices of the utterance."""

    tag: str
    value: str
    text: str
    first: int
    last: int
    detail: str = ""


@dataclass(frozen=True, slots=True)
class RawToken:
    """One word of the input and its index; breaks (commas, full stops) keep the index of the word before."""

    text: str
    index: int
    is_break: bool = False
