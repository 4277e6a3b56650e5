# SPDX-License-Identifier: Apache-2.0
"""Seventeen levels of difficulty, from "this" to nested likeness; each level must be read whole."""

from __future__ import annotations

import pytest
from corpus import summary
from uncom_common.primitive import Primitive
from uncom_language.parser import parse_text, sentence_to_json
from uncom_language.types import Act, Relation

# level: sentence, primitive, object (text, deictic, relation or comparison, with what), relation, target text
LEVELS = {
    "L1 this": ("pick up this", "pick", ("this", "this", "", ""), "none", None),
    "L1b that": ("take that one", "pick", ("that one", "that", "", ""), "none", None),
    "L2 class": ("pick up this thing", "pick", ("this thing", "this", "", ""), "none", None),
    "L2b quality": ("pick up this red thing", "pick", ("this red thing", "this", "", ""), "none", None),
    "L3 name": ("pick up the cup", "pick", ("cup", "", "", ""), "none", None),
    "L3b name and quality": ("pick up this red cup", "pick", ("red cup", "this", "", ""), "none", None),
    "L4 similar": ("pick up an object similar to this", "pick", ("object", "", "similar", "this"), "none", None),
    "L4b same colour": (
        "pick up the object with the same colour as this",
        "pick",
        ("object", "", "same_colour", "this"),
        "none",
        None,
    ),
    "L4c same size": (
        "pick up the cup the same size as this bowl",
        "pick",
        ("cup", "", "same_size", "bowl"),
        "none",
        None,
    ),
    "L5 beside": (
        "pick up the object to the right of this one",
        "pick",
        ("object", "", "right_of", "this one"),
        "none",
        None,
    ),
    "L5b chain": (
        "pick up the cup behind the bottle next to this box",
        "pick",
        ("cup", "", "behind", "bottle"),
        "none",
        None,
    ),
    "L6 put here": ("put this here", "place", ("this", "this", "", ""), "here", "here"),
    "L6b put on": ("put this on that red plate", "put_on", ("this", "this", "", ""), "on", "red plate"),
    "L6c take and put": (
        "take this cup and put it to the left of this one",
        "place",
        ("cup", "this", "", ""),
        "left_of",
        "this one",
    ),
    "L7 likeness": (
        "put this to the left of the object the same size as this",
        "place",
        ("this", "this", "", ""),
        "left_of",
        "object",
    ),
}


# Several steps: one thing over two steps, two things with a likeness.
STEPS = {
    "L7a steps": ("first pick up this then put it here", [["this", "place", "here", "here"]]),
    "L7b steps and likeness": (
        "first put this on that plate then put this one to the left of the object the same size as this",
        [["this", "put_on", "on", "plate"], ["this one", "place", "left_of", "object"]],
    ),
}


def hanging(reference):
    """Return what a reference hangs on and how: by place or by comparison."""
    if reference.comparison:
        return reference.comparison, reference.compared_to.text
    return reference.anchor_relation, reference.anchor.text if reference.anchor else ""


def test_there_are_seventeen_levels():
    assert len(LEVELS) + len(STEPS) == 17


@pytest.mark.parametrize("level", LEVELS)
def test_single_commands(level):
    text, primitive, (thing, deictic, *hung), relation, target = LEVELS[level]
    (command,) = parse_text(text)
    assert command.act is Act.COMMAND
    assert command.primitive is Primitive(primitive)
    assert (command.object.text, command.object.deictic) == (thing, deictic)
    assert hanging(command.object) == tuple(hung)
    assert command.relation is Relation(relation)
    assert (command.target.text if command.target else None) == target


def test_l7_keeps_what_the_target_is_compared_with():
    (command,) = parse_text(LEVELS["L7 likeness"][0])
    assert hanging(command.target) == ("same_size", "this")
    assert command.target.compared_to.deictic_span.start_s > command.object.deictic_span.start_s


@pytest.mark.parametrize("level", STEPS)
def test_several_steps(level):
    text, expected = STEPS[level]
    parsed = sentence_to_json(text, parse_text(text))
    assert parsed["act"] == "command"
    assert [summary(command) for command in parsed["commands"]] == expected
