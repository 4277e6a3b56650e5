# SPDX-License-Identifier: Apache-2.0
"""Seventeen levels of difficulty, from "this" to nested likeness; each level must be read whole."""

from __future__ import annotations

import pytest
from uncom_language.parser import parse_text
from uncom_language.types import Act, Primitive, Relation

# level: sentence, primitive, object (text, deictic, anchor relation, anchor text or deictic), relation, target text
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


@pytest.mark.parametrize("level", LEVELS)
def test_single_commands(level):
    text, primitive, (thing, deictic, anchored, anchor), relation, target = LEVELS[level]
    (command,) = parse_text(text)
    assert command.act is Act.COMMAND
    assert command.primitive is Primitive(primitive)
    assert (command.object.text, command.object.deictic, command.object.anchor_relation) == (thing, deictic, anchored)
    assert (command.object.anchor.text if command.object.anchor else "") == anchor
    assert command.relation is Relation(relation)
    assert (command.target.text if command.target else None) == target


def test_l7_keeps_what_hangs_on_the_target():
    (command,) = parse_text(LEVELS["L7 likeness"][0])
    assert (command.target.anchor_relation, command.target.anchor.deictic) == ("same_size", "this")
    assert command.target.anchor.deictic_span.start_s > command.object.deictic_span.start_s


@pytest.mark.parametrize(
    "text",
    [
        "first pick up this then put it here",  # L7a: several steps, one thing
        "first put this on that plate then put this one to the left of the object the same size as this",  # L7b
    ],
)
def test_several_steps(text):
    commands = parse_text(text)
    assert all(command.act is Act.COMMAND for command in commands)
    assert commands[-1].target is not None
