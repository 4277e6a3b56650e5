# SPDX-License-Identifier: Apache-2.0
"""References, times and robustness of the grammar parser."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from uncom_common.primitive import Primitive
from uncom_language.exceptions import UnknownLanguageError
from uncom_language.language_understanding import LanguageUnderstanding
from uncom_language.parser import command_to_json, load_parser, parse_text, parse_transcript
from uncom_language.parser.lexical.lexicon import load_lexicon
from uncom_language.types import Act, Alternative, Relation, Transcript, Word


def heard(text, start=10.0, step=0.5):
    return tuple(Word(word, start + i * step, start + i * step + 0.4) for i, word in enumerate(text.split()))


def test_parts_keep_the_times_of_their_words():
    words = heard("take this lemon and put it in that big bowl")
    (command,) = parse_transcript(Transcript("u1", words))
    assert command.utterance_id == "u1"
    assert (command.object.span.start_s, command.object.span.end_s) == (words[1].start_s, words[2].end_s)
    assert (command.object.deictic_span.start_s, command.object.deictic_span.end_s) == (
        words[1].start_s,
        words[1].end_s,
    )
    assert (command.target.span.start_s, command.target.span.end_s) == (words[7].start_s, words[9].end_s)
    assert command.target.deictic_span.start_s == words[7].start_s
    assert command.action_span.start_s == words[4].start_s


def test_times_survive_hesitation_and_politeness():
    words = heard("um could you please put this uh here")
    (command,) = parse_transcript(Transcript("u", words))
    assert command.object.deictic_span.start_s == words[5].start_s
    assert command.target.deictic_span.start_s == words[7].start_s


def test_a_second_pair_of_deictic_words_keeps_its_own_times():
    words = heard("put this here and put that there")
    first, second = parse_transcript(Transcript("u", words))
    assert first.object.span.start_s == words[1].start_s
    assert second.object.span.start_s == words[5].start_s
    assert second.target.span.start_s == words[6].start_s


def test_a_noun_beside_a_deictic_word_stays_concrete():
    (command,) = parse_text("take this mug and put it on this thing")
    assert (command.object.text, command.object.deictic, command.object.concrete) == ("mug", "this", True)
    assert (command.target.text, command.target.deictic, command.target.concrete) == ("this thing", "this", False)


def test_locating_phrases_hang_on_the_thing_they_locate():
    (command,) = parse_text("put the cup next to the bottle on the plate behind the box")
    assert (command.object.anchor_relation, command.object.anchor.text) == ("next_to", "bottle")
    assert (command.target.anchor_relation, command.target.anchor.text) == ("behind", "box")
    assert command.object.anchor.anchor is None


@pytest.mark.parametrize(
    ("phrase", "comparison", "other"),
    [
        ("the cup with the same colour as this", "same_colour", "this"),
        ("the cup of this colour", "same_colour", "this"),
        ("the one with a different size than the red bowl", "other_size", "red bowl"),
        ("the same kind of cup as that one", "same_kind", "that one"),
        ("a cup bigger than this one", "bigger", "this one"),
        ("the can that is shorter than the bottle", "shorter", "bottle"),
        ("the apple closest to the bowl", "nearest", "bowl"),
        ("something like this", "similar", "this"),
    ],
)
def test_comparisons_name_what_is_compared_with_what(phrase, comparison, other):
    (command,) = parse_text(f"pick up {phrase}")
    assert (command.object.comparison, command.object.compared_to.text) == (comparison, other)
    assert command.object.anchor is None


@pytest.mark.parametrize(
    ("phrase", "ordinal", "side"),
    [
        ("the second cup from the left", 2, "left"),
        ("the first one on the right", 1, "right"),
        ("the last one", -1, ""),
        ("the second to last cup from the front", -2, "front"),
        ("the third biggest cup", 3, ""),
        ("the cup", 0, ""),
    ],
)
def test_ordinals_are_counted_from_a_side(phrase, ordinal, side):
    (command,) = parse_text(f"pick up {phrase}")
    assert (command.object.ordinal, command.object.ordinal_side) == (ordinal, side)
    assert "second" not in command.object.modifiers


@pytest.mark.parametrize(
    ("phrase", "excluded", "except_for"),
    [
        ("the cup that is not red", ("red",), None),
        ("the cups except the red one", ("red",), "red one"),
        ("any fruit but the banana", ("banana",), "banana"),
        ("the small one, not the big one", ("big",), "big one"),
        ("any mug other than this", (), "this"),
        ("the apple that isn't in the bowl", ("in the bowl",), None),
    ],
)
def test_exclusions_tell_what_a_thing_must_not_be(phrase, excluded, except_for):
    (command,) = parse_text(f"pick up {phrase}")
    assert command.object.excluded_modifiers == excluded
    assert (command.object.compared_to.text if command.object.compared_to else None) == except_for
    assert command.object.comparison == ("except" if except_for else "")


@pytest.mark.parametrize(
    ("text", "distance_m"),
    [
        ("move it a bit to the left", 0.05),
        ("move the cup 10 cm to the right", 0.1),
        ("put it two inches behind the bowl", 0.0508),
        ("move the cup 2.5 centimeters to the left", 0.025),
        ("move it to the left by five centimeters", 0.05),
        ("put it to the left", 0.0),
    ],
)
def test_distances_are_metres(text, distance_m):
    (command,) = parse_text(text)
    assert command.act is Act.COMMAND
    assert command.distance_m == pytest.approx(distance_m)


def test_sides_of_a_thing_are_qualities_and_not_its_text():
    (command,) = parse_text("put the cup on the left into the bowl on the right")
    assert (command.object.text, command.object.modifiers) == ("cup", ("left",))
    assert (command.target.text, command.target.modifiers) == ("bowl", ("right",))


def test_a_correction_holds_only_what_changes():
    (thing,) = parse_text("no, the green one")
    assert (thing.act, thing.object.text, thing.target, thing.relation) == (
        Act.CORRECTION,
        "green one",
        None,
        Relation.NONE,
    )
    (place,) = parse_text("a bit to the left")
    assert (place.act, place.object, place.relation, place.distance_m) == (
        Act.CORRECTION,
        None,
        Relation.LEFT_OF,
        0.05,
    )


def test_yes_with_a_condition_is_no_yes():
    assert [command.act for command in parse_text("yes but you are too slow")] == [Act.REFUSED]
    assert [command.act for command in parse_text("no that is what he said")] == [Act.NO]
    assert [command.act for command in parse_text("yes, put it there")] == [Act.YES, Act.COMMAND]


def test_a_sentence_that_breaks_off_is_never_a_command():
    whole = ["put", "the", "red", "cup", "to", "the", "left", "of", "the", "small", "box"]
    for length in range(1, len(whole)):
        (command,) = parse_text(" ".join(whole[:length]))
        # "to the left" is a place, and "the small" may be a thing, as in "put the blue on the red".
        assert command.act is not Act.COMMAND or whole[length - 1] in ("left", "small")


def test_quantities():
    counted = [
        parse_text(f"pick up {what}")[0].object.quantity
        for what in ("the cup", "two cups", "both cups", "all the cups", "these", "three of the cups")
    ]
    assert counted == [1, 2, 2, 0, 0, 3]


def test_a_pronoun_stands_for_the_thing_spoken_of_before():
    _, second = parse_text("put the apple in the bowl then move it behind the box")
    assert (second.object.text, second.object.anaphoric) == ("apple", True)


@pytest.mark.parametrize(
    ("noun", "head", "quantity"), [("gizmos", "gizmo", 0), ("glitches", "glitch", 0), ("truss", "truss", 1)]
)
def test_nouns_that_nobody_listed_have_plurals_too(noun, head, quantity):
    (command,) = parse_text(f"pick up the {noun}")
    assert (command.object.text, command.object.head, command.object.quantity) == (noun, head, quantity)


def test_plural_heads_are_lemmas():
    (command,) = parse_text("put the spoons and the knives in the boxes")[:1]
    assert command.object.head == "spoon"
    assert command.target.head == "box"


def test_words_inside_words_mean_nothing():
    (command,) = parse_text("put the brightener on the closet")
    assert (command.object.text, command.relation, command.target.text) == ("brightener", Relation.ON, "closet")


def test_json_has_the_agreed_layout():
    made = command_to_json(parse_text("place the orange between the apple and the can")[0])
    assert {"object", "action", "target", "relation", "reference2"} <= set(made)
    assert {"text", "head", "modifiers", "concrete"} <= set(made["object"])
    assert {"text", "primitive"} <= set(made["action"])
    assert made["reference2"]["text"] == "can"


def test_an_alternative_is_taken_only_if_the_best_words_make_no_command():
    best = heard("put the banana in the the")
    other = Alternative(heard("put the banana in the bowl"), -2.0)
    (command,) = LanguageUnderstanding().understand(Transcript("u", best, (other,)))
    assert (command.act, command.primitive, command.target.text) == (Act.COMMAND, Primitive.PUT_IN, "bowl")
    assert "alternative" in command.notes[0]
    (refused,) = LanguageUnderstanding(max_alternative_loss=1.0).understand(Transcript("u", best, (other,)))
    assert refused.act is Act.INCOMPLETE


def test_an_alternative_never_invents_an_action():
    other = Alternative(heard("take the light"), -0.5)
    (command,) = LanguageUnderstanding().understand(Transcript("u", heard("turn the light"), (other,)))
    assert command.act is Act.REFUSED


def test_an_unknown_language_is_a_clear_error():
    with pytest.raises(UnknownLanguageError, match=r"choose one of: .*en"):
        load_parser("tlh")


VOCABULARY = sorted({word for phrase in load_lexicon().phrases for word in phrase} | {"zork", "is", "no", "wait", ","})


@given(st.lists(st.sampled_from(VOCABULARY), max_size=14))
def test_any_words_give_an_answer(words):
    commands = parse_text(" ".join(words))
    assert commands
    assert all(command.reason for command in commands if command.act in (Act.REFUSED, Act.INCOMPLETE))
    assert [command.index for command in commands] == list(range(len(commands)))


@given(st.text(max_size=60))
def test_any_text_gives_an_answer(text):
    assert parse_text(text)
