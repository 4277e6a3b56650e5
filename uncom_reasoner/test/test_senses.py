# SPDX-License-Identifier: Apache-2.0
"""What is kept of the senses, and which frame is looked at."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from reasoner_scenes import POSE, TABLE_Z, command, pointing, reference
from uncom_reasoner.evidence.frame_buffer import StampedBuffer, choose_scene_frame
from uncom_reasoner.evidence.gesture_timing import gestures_complete, words_span
from uncom_reasoner.pointing.ray_fusion import observe_rays
from uncom_reasoner.session.task import GroundingTask
from uncom_reasoner.weights import load_weights


@given(st.lists(st.floats(0.0, 1000.0), max_size=300))
def test_a_buffer_is_bounded_in_time_and_number(stamps):
    buffer: StampedBuffer[int] = StampedBuffer(10.0, 8.0)
    for i, stamp in enumerate(stamps):
        buffer.add(stamp, i)
    kept = [stamp for stamp, _ in buffer.items()]
    assert kept == sorted(kept)
    assert len(kept) <= 82
    assert not kept or kept[-1] - kept[0] <= 10.0


def test_two_streams_of_the_same_stamps_keep_the_same_ones():
    first, second = StampedBuffer(10.0, 8.0), StampedBuffer(10.0, 8.0)
    for stamp in np.arange(5.0, 8.0, 1.0 / 30.0):
        first.add(stamp, "rgb")
        second.add(stamp, "depth")
    assert [s for s, _ in first.items()] == [s for s, _ in second.items()]
    assert len(first.items()) <= 25


def test_a_bag_that_starts_again_empties_the_buffer():
    buffer: StampedBuffer[str] = StampedBuffer(10.0)
    buffer.add(100.0, "old")
    buffer.add(20.0, "new")
    assert [item for _, item in buffer.items()] == ["new"]


FRAMES = [float(t) for t in np.arange(0.0, 6.0, 0.125)]


def hands(start, end):
    return [(t, start <= t <= end) for t in FRAMES]


def test_the_scene_is_seen_before_the_hand_comes_in():
    found = choose_scene_frame(FRAMES, hands(2.0, 5.0), 3.0, 0.4, 0.8)
    assert not found.with_hand
    assert found.stamp_s < 2.0 - 0.8


def test_a_hand_that_was_there_from_the_start_but_left_is_no_trouble():
    found = choose_scene_frame(FRAMES, hands(0.0, 4.0), 3.0, 0.4, 0.8)
    assert not found.with_hand
    assert found.stamp_s > 4.4


def test_with_a_hand_all_the_time_the_object_frame_is_used_with_the_hand():
    found = choose_scene_frame(FRAMES, hands(0.0, 9.0), 3.0, 0.4, 0.8)
    assert (found.stamp_s, found.with_hand) == (3.0, True)
    assert choose_scene_frame([], [], 0.0, 0.4, 0.8) is None


def test_without_a_gesture_node_the_wait_ends():
    named = command(reference("lemon", 1.0, 1.4), reference("bowl", 2.0, 2.4))
    task = GroundingTask(named, received_s=3.0, received_steady_s=50.0)
    assert words_span(task.command).end_s == 2.4
    assert not task.is_out_of_time(4.9, 51.9, 0.6, 2.0)
    assert task.is_out_of_time(5.1, 52.1, 0.6, 2.0)
    assert task.is_out_of_time(3.0, 56.1, 0.6, 2.0)  # should the clock of the stamps stand still


def test_words_that_need_no_gesture_do_not_wait_for_one():
    named = command(reference("lemon", 1.0, 1.4), reference("bowl", 2.0, 2.4))
    weights = load_weights()
    assert gestures_complete(named, (), 2.35, 0.6, weights)
    assert not gestures_complete(named, (), 1.9, 0.6, weights)


def test_a_pointing_word_waits_for_its_gesture_and_no_longer_than_that():
    here = reference("here", 2.0, 2.4, concrete=False, deictic="here")
    pointed = command(reference("lemon", 1.0, 1.4), here)
    weights = load_weights()
    rays = observe_rays(pointing((0.6, 0.1, TABLE_Z), (0.8, 0.1, 0.9), np.arange(1.9, 2.6, 0.1)), lambda _: POSE)
    assert gestures_complete(pointed, rays, 2.66, 0.6, weights)
    assert not gestures_complete(pointed, (), 2.66, 0.6, weights)
    assert gestures_complete(pointed, (), 3.0, 0.6, weights)


def test_the_look_at_the_object_is_not_taken_for_here_while_the_hand_is_on_its_way():
    """The finger comes late: it was on the lemon before "here", and arrives after the word has begun."""
    here = reference("here", 2.0, 2.4, concrete=False, deictic="here")
    pointed = command(reference("lemon", 1.0, 1.4), here)
    weights = load_weights()
    lemon = pointing((0.6, 0.3, TABLE_Z), (0.8, 0.3, 0.9), np.arange(1.0, 1.9, 0.1))
    place = pointing((0.6, -0.1, TABLE_Z), (0.8, 0.0, 0.9), np.arange(2.3, 3.1, 0.1))
    seen = [observe_rays([h for h in lemon + place if h.stamp_s <= t], lambda _: POSE) for t in (2.3, 2.7)]
    assert not gestures_complete(pointed, seen[0], 2.66, 0.6, weights)
    assert gestures_complete(pointed, seen[1], 2.75, 0.6, weights)
