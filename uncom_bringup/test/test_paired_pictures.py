# SPDX-License-Identifier: Apache-2.0
"""A picture's depth comes right before it, whatever their order in the bag; nothing else changes its place."""

from __future__ import annotations

import random
import struct

import pytest
from uncom_bringup.bags.bag_reader import BagMessage, BagTopic
from uncom_bringup.bags.depth_first_order import with_depth_first

PICTURE, DEPTH, SOUND = "/rgb", "/depth", "/audio"
LATER_NS = 60_000_000


def message(name, time_ms, stamp_ms=None):
    """Return a message whose data begin as a serialised header does."""
    stamp = time_ms if stamp_ms is None else stamp_ms
    data = bytes([0, 1, 0, 0]) + struct.pack("<iI", stamp // 1000, stamp % 1000 * 1_000_000)
    return BagMessage(BagTopic(name, "", latched=False), time_ms * 1_000_000, data)


def paired(*messages, depths=(DEPTH,)):
    return [(m.topic.name, m.time_ns // 1_000_000) for m in with_depth_first(messages, [PICTURE], depths, LATER_NS)]


def test_a_depth_that_was_recorded_later_comes_first_at_the_time_of_its_picture():
    got = paired(message(PICTURE, 100), message(SOUND, 110), message(DEPTH, 120, 100), message(SOUND, 130))
    assert got == [(DEPTH, 100), (PICTURE, 100), (SOUND, 110), (SOUND, 130)]


def test_a_depth_that_was_recorded_before_stays_where_it_is():
    got = paired(message(DEPTH, 90, 100), message(SOUND, 95), message(PICTURE, 100), message(SOUND, 110))
    assert got == [(DEPTH, 90), (SOUND, 95), (PICTURE, 100), (SOUND, 110)]


@pytest.mark.parametrize("late_ms", [61, 500])
def test_a_picture_does_not_wait_for_a_depth_that_is_too_late_or_never_comes(late_ms):
    sounds = [message(SOUND, 100 + 10 * i) for i in range(1, 8)]
    depth = message(DEPTH, 100 + late_ms, 100)
    assert paired(message(PICTURE, 100), *sounds, depth)[0] == (PICTURE, 100)
    assert paired(message(PICTURE, 100), message(SOUND, 110)) == [(PICTURE, 100), (SOUND, 110)]


def test_without_depth_nothing_is_held_back():
    first = with_depth_first(iter([message(PICTURE, 100), message(SOUND, 110)]), [PICTURE], [], LATER_NS)
    assert next(first).topic.name == PICTURE


def test_two_pictures_wait_for_a_depth_each():
    got = paired(message(PICTURE, 100), message(PICTURE, 133), message(DEPTH, 140, 100), message(DEPTH, 170, 133))
    assert got == [(DEPTH, 100), (PICTURE, 100), (DEPTH, 133), (PICTURE, 133)]


def test_nothing_is_lost_and_pictures_and_sounds_keep_their_order():
    dice = random.Random(3)
    made = [message(PICTURE, 33 * i) for i in range(60)] + [message(SOUND, 20 * i) for i in range(100)]
    made += [message(DEPTH, 33 * i + dice.randrange(-30, 90), 33 * i) for i in range(60) if dice.random() < 0.8]
    made.sort(key=lambda m: m.time_ns)
    got = list(with_depth_first(made, [PICTURE], [DEPTH], LATER_NS))
    assert sorted(m.data for m in got) == sorted(m.data for m in made)
    assert [m for m in got if m.topic.name != DEPTH] == [m for m in made if m.topic.name != DEPTH]
    assert [m.time_ns for m in got] == sorted(m.time_ns for m in got)
