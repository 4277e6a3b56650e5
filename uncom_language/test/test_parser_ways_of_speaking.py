# SPDX-License-Identifier: Apache-2.0
"""What people say beside plain commands: stutter, "let the robot", parts of the table, throwing things away."""

from __future__ import annotations

import pytest
from uncom_common.primitive import Primitive
from uncom_language.parser import parse_text
from uncom_language.types import Act, Relation


@pytest.mark.parametrize("text", ["throw away the banana", "throw this can away", "get rid of the lemon"])
def test_what_is_to_be_thrown_away_is_refused_by_name(text):
    (command,) = parse_text(text)
    assert command.act is Act.REFUSED
    assert "nothing that I do" in command.reason


@pytest.mark.parametrize("text", ["can i have a twenty ounce american mad plate milk", "i want a tall latte"])
def test_an_order_of_unknown_words_is_no_command(text):
    assert all(command.act is Act.REFUSED for command in parse_text(text))


def test_what_is_thrown_into_a_bin_is_put_there():
    (command,) = parse_text("throw the empty can into the bin")
    assert (command.primitive, command.relation, command.target.text) == (Primitive.PUT_IN, Relation.IN, "bin")


@pytest.mark.parametrize(
    ("stuttered", "plain"),
    [
        ("put it in in the bowl", "put it in the bowl"),
        ("put the the lemon on the plate", "put the lemon on the plate"),
        ("take take the red mug", "take the red mug"),
        ("put the spoon next to next to the cup", "put the spoon next to the cup"),
    ],
)
def test_words_said_twice_in_a_row_count_once(stuttered, plain):
    (said,), (meant,) = parse_text(stuttered), parse_text(plain)
    assert (said.act, said.primitive, said.relation) == (Act.COMMAND, meant.primitive, meant.relation)
    assert said.object.text == meant.object.text
    assert (said.target and said.target.text) == (meant.target and meant.target.text)


@pytest.mark.parametrize(
    ("begun", "plain"),
    [
        ("place this lemon in on this plate", "place this lemon on this plate"),
        ("put it on next to the box", "put it next to the box"),
        ("move the can on in front of the pan", "move the can in front of the pan"),
        ("place this thing in on this", "place this thing on this"),
        ("place this thing in over there", "place this thing over there"),
        ("move it to over here", "move it over here"),
        ("place it on between the plates", "place it between the plates"),
    ],
)
def test_a_relation_that_is_given_up_for_the_next_one_does_not_count(begun, plain):
    (said,), (meant,) = parse_text(begun), parse_text(plain)
    assert (said.act, said.primitive, said.relation) == (Act.COMMAND, meant.primitive, meant.relation)
    assert (said.object.text, said.target.text) == (meant.object.text, meant.target.text)


@pytest.mark.parametrize("opening", ["let the robot", "have the robot", "tell the robot to", "i'd love you to"])
def test_the_robot_may_be_spoken_of(opening):
    (command,) = parse_text(f"{opening} put the lemon in the bowl")
    assert (command.object.text, command.primitive, command.target.text) == ("lemon", Primitive.PUT_IN, "bowl")


@pytest.mark.parametrize("where", ["anywhere free", "somewhere free", "wherever there is room", "in a free spot"])
def test_a_thing_may_be_put_where_there_is_room(where):
    (command,) = parse_text(f"put the lemon {where}")
    assert (command.act, command.object.text, command.target) == (Act.COMMAND, "lemon", None)


@pytest.mark.parametrize(
    "where",
    [
        "in the middle of the table",
        "in the corner",
        "in the corner of the table",
        "at the edge",
        "at the edge of the table",
        "on the left side of the table",
        "to the far end of the table",
    ],
)
def test_a_part_of_the_table_is_on_the_table(where):
    (command,) = parse_text(f"put the mug {where}")
    assert (command.act, command.primitive, command.relation) == (Act.COMMAND, Primitive.PUT_ON, Relation.ON)
    assert (command.object.text, command.target.text) == ("mug", "table")


def test_a_side_of_another_thing_stays_a_side():
    (command,) = parse_text("put the mug on the left side of the box")
    assert (command.relation, command.target.text) == (Relation.LEFT_OF, "box")


@pytest.mark.parametrize(("place", "target"), [("this", "this"), ("that box", "box"), ("the bowl", "bowl")])
def test_near_after_a_bare_this_is_a_relation_and_no_quality(place, target):
    (command,) = parse_text(f"please put this near {place}")
    assert (command.act, command.relation) == (Act.COMMAND, Relation.NEAR)
    assert (command.object.text, command.target.text) == ("this", target)
