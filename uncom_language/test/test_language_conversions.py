# SPDX-License-Identifier: Apache-2.0
"""Values survive the way through messages."""

from __future__ import annotations

import pytest
from uncom_language.conversions import (
    command_from_msg,
    command_to_msg,
    reference_from_msg,
    reference_to_msg,
    speech_status_from_msg,
    speech_status_to_msg,
    transcript_from_msg,
    transcript_to_msg,
    vocabulary_from_msg,
    vocabulary_to_msg,
)
from uncom_language.exceptions import LexiconError
from uncom_language.parser import parse_transcript
from uncom_language.speech.speech_status import SpeechState, SpeechStatus
from uncom_language.types import Act, Alternative, Command, Reference, Span, Transcript, Word

SENTENCES = (
    "put the cup next to the bottle on the plate behind the box",
    "place this between the red apple and the can",
    "pick up the second one from the left",
    "put it here",
    "stop",
    "hello there",
    "put the banana",
    "take these and put them in the other bowl",
)


def heard(text):
    return tuple(Word(word, 100.0 + i, 100.5 + i, 0.5) for i, word in enumerate(text.split()))


def test_a_transcript_survives():
    words = heard("put it here")
    transcript = Transcript("u-1", words, (Alternative(words[:2], -1.5),), "en", "some recogniser", 0.25)
    msg = transcript_to_msg(transcript)
    assert msg.text == "put it here"
    assert msg.header.stamp == msg.words[-1].end
    assert transcript_from_msg(msg) == transcript


@pytest.mark.parametrize("text", SENTENCES)
def test_commands_survive_with_all_that_hangs_on_them(text):
    for command in parse_transcript(Transcript("u-2", heard(text), language="en")):
        back = command_from_msg(command_to_msg(command, 120.0))
        assert back == command


def test_everything_that_a_reference_and_a_command_can_say_survives():
    span = Span(1.0, 1.5)
    bowl = Reference("bowl", "bowl", span, ("blue",))
    this = Reference(
        "this", "this", span, concrete=False, deictic="this", deictic_span=span, anchor=bowl, anchor_relation="on"
    )
    cup = Reference(
        "second cup",
        "cup",
        span,
        excluded_modifiers=("red", "small"),
        ordinal=-2,
        ordinal_side="left",
        comparison="same_colour",
        compared_to=this,
        heard="cap",
        anchor=bowl,
        anchor_relation="next_to",
    )
    command = Command(
        "u", Act.CORRECTION, "no the second cup", object=cup, distance_m=0.05, notes=("one", "two"), backend="grammar"
    )
    assert command_from_msg(command_to_msg(command, 3.0)) == command


def test_anchors_are_flat_in_the_message():
    (command,) = parse_transcript(Transcript("u", heard(SENTENCES[0])))
    msg = command_to_msg(command, 0.0)
    assert [anchor.text for anchor in msg.anchors] == ["bottle", "box"]
    assert (msg.object.anchor, msg.target.anchor) == (0, 1)


def test_a_missing_part_survives():
    anchors = []
    assert reference_from_msg(reference_to_msg(None, anchors), anchors) is None


def test_a_vocabulary_survives_and_a_wrong_count_of_pronunciations_is_an_error():
    words = {"gizmo": "G IH Z M OW", "flange": ""}
    msg = vocabulary_to_msg(words, 3.0)
    assert vocabulary_from_msg(msg) == words
    msg.pronunciations = []
    assert vocabulary_from_msg(msg) == {"gizmo": "", "flange": ""}
    msg.pronunciations = ["G"]
    with pytest.raises(LexiconError, match="2 words came with 1 pronunciations"):
        vocabulary_from_msg(msg)


def test_the_status_survives():
    status = SpeechStatus(12.5, SpeechState.RECOGNISING, 3, "silence")
    assert speech_status_from_msg(speech_status_to_msg(status)) == status
