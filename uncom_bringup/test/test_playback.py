# SPDX-License-Identifier: Apache-2.0
"""The pace of a replay: spacing, rate, pause, single steps, stop; and reading ahead."""

from __future__ import annotations

import os
import pty
import sys
from dataclasses import dataclass

import numpy as np
import pytest
from uncom_bringup.commands.replay import remappings
from uncom_bringup.exceptions import BadInputError
from uncom_bringup.replay.keyboard import DOWN, RIGHT, SPACE, UP, Keyboard
from uncom_bringup.replay.playback_clock import Playback, prefetch


@dataclass(frozen=True)
class Item:
    time_ns: int


def items(count, period_s=0.02, start_s=100.0):
    return [Item(int(1e9 * (start_s + number * period_s))) for number in range(count)]


START_NS = 100_000_000_000


class Play:
    """Plays items in a time of its own, with keys pressed after so many messages; keeps when what was sent.

    Its time goes on by what is slept and by 20 us each time that it is read, so that no other job delays it.
    """

    def __init__(self, keys=()):
        self.sent, self.clock, self.keys = [], [], list(keys)
        self.now_s = 7.0
        self.playback = Playback(self.send, self.clock.append, self.key, now_s=self.read_time, sleep=self.sleep)

    def read_time(self):
        self.now_s += 2e-5
        return self.now_s

    def sleep(self, duration_s):
        self.now_s += duration_s

    def send(self, item):
        self.sent.append((self.now_s, item.time_ns))

    def key(self):
        if self.keys and len(self.sent) >= self.keys[0][0]:
            return self.keys.pop(0)[1]
        return None

    def play(self, todo, rate=1.0):
        return self.playback.play(todo, START_NS, rate)


@pytest.mark.parametrize("rate", [0.5, 1.0, 4.0])
def test_items_are_sent_in_order_and_spaced_as_recorded(rate):
    run = Play()
    played = run.play(items(30), rate)
    when = np.array([moment for moment, _ in run.sent])
    due = np.array([1e-9 * (ns - START_NS) / rate for _, ns in run.sent])
    assert [ns for _, ns in run.sent] == [item.time_ns for item in items(30)]
    assert (when - when[0]) == pytest.approx(due, abs=1e-3)
    assert (when - 7.0 - due).min() >= 0.0, "never early"
    assert (played.count, played.ended) == (30, True)
    assert played.late_s < 1e-3


def test_the_clock_never_goes_back_and_runs_between_messages():
    run = Play()
    run.play(items(3, period_s=0.1))
    assert run.clock == sorted(run.clock)
    assert len(run.clock) > 10
    assert run.clock[-1] == items(3, period_s=0.1)[-1].time_ns


def test_a_pause_holds_the_clock_and_steps_send_one_message_each():
    run = Play([(3, SPACE), (3, RIGHT), (4, "s"), (5, SPACE)])
    played = run.play(items(10))
    assert (played.count, played.ended) == (10, True)
    assert len(run.sent) == 10
    assert run.clock == sorted(run.clock)


def test_a_step_while_playing_pauses():
    run = Play([(2, RIGHT), (3, "q")])
    played = run.play(items(10))
    assert (played.count, played.ended) == (3, False)


def test_up_and_down_change_the_rate_and_nothing_is_left_out():
    run = Play([(1, UP), (5, UP), (8, DOWN)])
    played = run.play(items(12))
    assert run.playback.rate == pytest.approx(1.25)
    assert played.count == 12


def test_what_is_made_ahead_comes_in_order_and_its_error_is_raised():
    def source():
        yield from items(100)
        raise BadInputError("the bag ends here")

    found = []
    with pytest.raises(BadInputError, match="ends here"):
        found.extend(prefetch(source()))
    assert found == items(100)
    reader = prefetch(source())
    assert [next(reader) for _ in range(3)] == items(3)
    reader.close()


def test_keys_come_one_by_one_from_a_terminal(monkeypatch):
    master, slave = pty.openpty()
    with os.fdopen(slave, "r") as terminal:
        monkeypatch.setattr(sys, "stdin", terminal)
        with Keyboard() as keyboard:
            assert keyboard.present
            assert keyboard.key() is None
            for data, name in ((b" ", SPACE), (b"\x1b[C", RIGHT), (b"\x1b[A", UP), (b"Q", "q")):
                os.write(master, data)
                assert keyboard.key() == name
    os.close(master)


def test_outside_a_terminal_there_are_no_keys(monkeypatch, tmp_path):
    with (tmp_path / "empty").open("w+") as file:
        monkeypatch.setattr(sys, "stdin", file)
        with Keyboard() as keyboard:
            assert not keyboard.present
            assert keyboard.key() is None


def test_remappings_are_read_and_checked():
    assert remappings(["/a/b:=c", "d:=/e"]) == {"/a/b": "/c", "/d": "/e"}
    for text in ("/a", "/a=/b", "a:=", ":=b", "/a:=b c", "//a:=b"):
        with pytest.raises(BadInputError, match="old/name"):
            remappings([text])
