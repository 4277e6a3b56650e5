# SPDX-License-Identifier: Apache-2.0
"""The grammar parser on labelled sentences of every kind: each one of the half that it was developed on, and the
share that is right of the half that was written before and never looked at."""

from __future__ import annotations

import time

import pytest
from corpus import SPECIAL, is_right, load
from uncom_language.parser import parse_text
from uncom_language.types import Act

DEVELOPED = [(kind, text, label) for kind, entries in load("sentences").items() for text, label in entries.items()]
HELD_OUT = load("held_out")


@pytest.mark.parametrize(("kind", "text", "label"), DEVELOPED)
def test_sentences_are_read_as_labelled(kind, text, label):
    assert is_right(kind, text, label)


@pytest.mark.parametrize(("kind", "least"), [("ordinary", 0.95), ("hard", 0.85)])
def test_sentences_that_nothing_was_developed_on_are_mostly_right(kind, least):
    right = [is_right(kind, text, label) for text, label in HELD_OUT[kind].items()]
    assert sum(right) / len(right) >= least


def test_acts_refusals_and_broken_sentences_that_nothing_was_developed_on_are_mostly_right():
    right = [is_right(kind, text, label) for kind in SPECIAL for text, label in HELD_OUT[kind].items()]
    assert sum(right) / len(right) >= 0.85


def test_what_is_no_command_never_moves_anything():
    for text in HELD_OUT["refused"]:
        assert all(command.act is not Act.COMMAND for command in parse_text(text)), text


def test_both_halves_together_are_three_hundred_sentences_of_which_half_is_held_out():
    held_out = {text for entries in HELD_OUT.values() for text in entries}
    developed = {text for _, text, _ in DEVELOPED}
    assert len(held_out | developed) >= 300
    assert len(held_out) >= 150
    assert not held_out & developed


def test_a_sentence_takes_less_than_two_milliseconds():
    """The best of three rounds: what else the machine does only adds to the time."""
    texts = [text for _, text, _ in DEVELOPED]
    rounds = []
    for _ in range(3):
        started = time.process_time()
        for text in texts:
            parse_text(text)
        rounds.append((time.process_time() - started) / len(texts))
    assert min(rounds) < 0.002
