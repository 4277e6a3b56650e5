# SPDX-License-Identifier: Apache-2.0
"""The German pack, whose verb may come last: the same parser, other data."""

from __future__ import annotations

import pytest
from corpus import is_right, load
from uncom_language.language_understanding import LanguageUnderstanding
from uncom_language.parser import load_parser, parse_text
from uncom_language.types import Act, Transcript, Word

SENTENCES = [(kind, text, label) for kind, entries in load("german").items() for text, label in entries.items()]


@pytest.mark.parametrize(("kind", "text", "label"), SENTENCES)
def test_german_sentences_are_read_as_labelled(kind, text, label):
    assert is_right(kind, text, label, "de")


def heard(text):
    return Transcript("u", tuple(Word(w, 5.0 + i, 5.5 + i) for i, w in enumerate(text.split())), language="de")


def test_parts_before_and_behind_the_verb_keep_their_own_times():
    (command,) = LanguageUnderstanding(language="de").understand(heard("kannst du diese Tasse auf das Brett stellen"))
    assert command.object.deictic_span.start_s == 7.0
    assert (command.target.span.start_s, command.target.span.end_s) == (10.0, 11.5)
    assert command.action_span.start_s == 12.0


def test_what_is_understood_speaks_of_things_in_the_detectors_words():
    (command,) = LanguageUnderstanding(language="de").understand(
        heard("leg die kleinen roten Äpfel in diese große Schüssel")
    )
    assert (command.object.head, command.object.modifiers, command.object.quantity) == ("apple", ("small", "red"), 0)
    assert (command.target.text, command.target.deictic) == ("big bowl", "this")


def test_languages_do_not_understand_each_other():
    assert parse_text("nimm die Zitrone", "en")[0].act is Act.REFUSED
    assert parse_text("take the lemon", "de")[0].act is Act.REFUSED


def test_the_back_end_names_its_language():
    assert load_parser("de").backend == "grammar (de)"
