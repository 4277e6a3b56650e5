# SPDX-License-Identifier: Apache-2.0
"""What is kept of the senses, and which frame is looked at."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from reasoner_scenes import command, reference
from uncom_reasoner.frames import StampedBuffer, scene_frame
from uncom_reasoner.job import Job, hands_complete, words_span


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
    found = scene_frame(FRAMES, hands(2.0, 5.0), 3.0, 0.4, 0.8)
    assert not found.with_hand
    assert found.stamp_s < 2.0 - 0.8


def test_a_hand_that_was_there_from_the_start_but_left_is_no_trouble():
    found = scene_frame(FRAMES, hands(0.0, 4.0), 3.0, 0.4, 0.8)
    assert not found.with_hand
    assert found.stamp_s > 4.4


def test_with_a_hand_all_the_time_the_object_frame_is_used_with_the_hand():
    found = scene_frame(FRAMES, hands(0.0, 9.0), 3.0, 0.4, 0.8)
    assert (found.stamp_s, found.with_hand) == (3.0, True)
    assert scene_frame([], [], 0.0, 0.4, 0.8) is None


def test_without_a_gesture_node_the_wait_ends():
    job = Job(command(reference("lemon", 1.0, 1.4), reference("bowl", 2.0, 2.4)), received_s=3.0, received_wall_s=50.0)
    assert words_span(job.command).end_s == 2.4
    assert hands_complete(job, 3.1, 3.1, 50.1, 0.6, 2.0)
    assert not hands_complete(job, 2.5, 3.1, 50.1, 0.6, 2.0)
    assert not hands_complete(job, float("-inf"), 4.9, 51.9, 0.6, 2.0)
    assert hands_complete(job, float("-inf"), 5.1, 52.1, 0.6, 2.0)
    assert hands_complete(job, float("-inf"), 3.0, 56.1, 0.6, 2.0)
