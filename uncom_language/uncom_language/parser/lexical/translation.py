# SPDX-License-Identifier: Apache-2.0
"""References in the words by which the detector knows objects: those of the English pack."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from uncom_language.parser.lexical.lexicon import load_lexicon
from uncom_language.types import Command, Reference

_DETECTOR_LANGUAGE = "en"


@cache
def _words(language: str) -> dict[str, str]:
    """Return every form of a word that the pack knows in English."""
    lexicon = load_lexicon(language)
    forms: dict[str, str] = {}
    for word, english in lexicon.concepts.items():
        for ending in lexicon.raw["adjective_endings"]:
            forms.setdefault(word + ending, english)
    # The word itself goes before an inflected form of another one.
    forms.update(lexicon.concepts)
    for plural, singular in lexicon.singular.items():
        if singular in lexicon.concepts:
            forms.setdefault(plural, lexicon.concepts[singular])
    return forms


def translate_references(command: Command, language: str) -> Command:
    """Return the command with the texts of its references in English; words that the pack lacks stay as they are."""
    if language == _DETECTOR_LANGUAGE:
        return command
    words = _words(language)
    return replace(
        command,
        object=_translated(command.object, words),
        target=_translated(command.target, words),
        reference2=_translated(command.reference2, words),
    )


def _translated(reference: Reference | None, words: dict[str, str]) -> Reference | None:
    if reference is None:
        return None
    return replace(
        reference,
        text=_phrase(reference.text, words),
        head=_phrase(reference.head, words),
        modifiers=tuple(_phrase(word, words) for word in reference.modifiers),
        excluded_modifiers=tuple(_phrase(word, words) for word in reference.excluded_modifiers),
        anchor=_translated(reference.anchor, words),
        compared_to=_translated(reference.compared_to, words),
    )


def _phrase(text: str, words: dict[str, str]) -> str:
    return words.get(text) or " ".join(words.get(word, word) for word in text.split())
