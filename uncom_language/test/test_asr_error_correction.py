# SPDX-License-Identifier: Apache-2.0
"""Misheard nouns are replaced on evidence only, and it is said."""

from __future__ import annotations

import pytest
from uncom_language.language_understanding import LanguageUnderstanding
from uncom_language.parser import parse_text
from uncom_language.parser.lexical.asr_error_correction import correct_nouns, find_correction
from uncom_language.types import Alternative, Transcript, Word


def words(text):
    return tuple(Word(word, float(i), i + 0.5) for i, word in enumerate(text.split()))


def test_a_ball_that_nobody_sees_is_the_bowl_that_is_there():
    (command,) = parse_text("put the lemon in the red ball")
    made = correct_nouns(command, ["lemon", "bowl", "cup"])
    assert (made.target.head, made.target.text, made.target.heard) == ("bowl", "red bowl", "ball")
    assert made.object == command.object
    assert made.notes == ("heard 'ball', taken as 'bowl': they sound alike (0.88), there is a bowl and no ball",)


@pytest.mark.parametrize(
    ("heard", "seen"),
    [
        ("ball", ["ball", "bowl"]),  # there is one
        ("can", ["pan"]),  # does not sound like it
        ("ball", []),  # nothing speaks for another word
        ("gizmo", ["cup", "bowl"]),
        ("spoon", ["spool"]),
        ("bull", ["bowl", "ball"]),  # either could be meant
    ],
)
def test_without_evidence_a_word_stands(heard, seen):
    assert find_correction(heard, seen) is None


def test_an_unknown_word_may_be_one_that_the_recogniser_also_heard():
    others = (Alternative(words("put it in the bowl"), -2.0),)
    assert find_correction("boll", [], others).meant == "bowl"
    assert find_correction("boll", []) is None
    assert find_correction("ball", [], others) is None  # a known word is replaced only by what is seen


def test_things_that_locate_others_are_mended_too():
    (command,) = parse_text("take the pair next to the ball")
    made = correct_nouns(command, ["pear", "bowl"])
    assert (made.object.head, made.object.heard) == ("pear", "pair")
    assert made.object.anchor.head == "bowl"
    assert len(made.notes) == 2


def test_words_that_are_offered_mend_unknown_nouns_only():
    understanding = LanguageUnderstanding()
    understanding.add_vocabulary(["sprocket", "bowl"])
    (command,) = understanding.understand(Transcript("u", words("take the sprocked and put it in the ball")))
    assert (command.object.head, command.object.heard) == ("sprocket", "sprocked")
    assert command.target.head == "ball"
