# SPDX-License-Identifier: Apache-2.0
"""The grammar parser on labelled sentences of every kind."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
import yaml
from uncom_language.parser import parse_text, sentence_to_json
from uncom_language.types import Act

CORPUS = yaml.safe_load((Path(__file__).parent / "data" / "sentences.yaml").read_text(encoding="utf-8"))
SPECIAL = ("acts", "refused", "incomplete")
COMMANDS = [(text, label) for kind, entries in CORPUS.items() if kind not in SPECIAL for text, label in entries.items()]


def summary(command):
    parts = [command["object"], command["target"]]
    found = [part["text"] if part else "-" for part in parts]
    made = [found[0], command["action"]["primitive"], command["relation"], found[1]]
    return made + ([command["reference2"]["text"]] if command["reference2"] else [])


@pytest.mark.parametrize(("text", "label"), COMMANDS)
def test_commands_are_read_as_labelled(text, label):
    expected = label if isinstance(label[0], list) else [label]
    parsed = sentence_to_json(text, parse_text(text))
    assert [summary(command) for command in parsed["commands"]] == expected
    assert parsed["act"] == "command"


@pytest.mark.parametrize(("text", "act"), CORPUS["acts"].items())
def test_dialogue_acts_carry_no_parts(text, act):
    parsed = sentence_to_json(text, parse_text(text))
    assert (parsed["act"], parsed["commands"]) == (act, [])


@pytest.mark.parametrize(("text", "word"), CORPUS["refused"].items())
def test_what_is_no_command_is_refused_with_a_reason(text, word):
    parsed = sentence_to_json(text, parse_text(text))
    assert (parsed["act"], parsed["commands"]) == ("refused", [])
    assert word in parsed["reason"]


@pytest.mark.parametrize(("text", "part"), CORPUS["incomplete"].items())
def test_an_incomplete_command_names_the_missing_part(text, part):
    (command,) = parse_text(text)
    assert command.act is Act.INCOMPLETE
    assert f"the {part} is missing" in command.reason


def test_a_sentence_takes_less_than_two_milliseconds():
    parse_text("put the cup on the plate")
    started = time.process_time()
    for text, _ in COMMANDS:
        parse_text(text)
    assert (time.process_time() - started) / len(COMMANDS) < 0.002
