# SPDX-License-Identifier: Apache-2.0
"""Processor time of the senses: below a bound in milliseconds, or in plain MediaPipe calls in the same process.

The ratio alone does not carry from one processor to another: measured, detection takes 2.6 plain calls of 61 ms on one
and 4.3 of 21 ms on another. So a fast machine is held to milliseconds and a slow one to the ratio.
"""

from __future__ import annotations

import time

import pytest
from perception_scenes import CAMERA, POSE, takes
from uncom_perception.hands.detection.mediapipe_hands import MediaPipeHands
from uncom_perception.hands.gesture_reader import make_reader
from uncom_perception.objects.detectors.tabletop_detector import TabletopDetector
from uncom_perception.rgbd_frame import RgbdFrame

KINDS = ("mug", "bowl", "apple", "can", "pear", "lemon", "banana", "cup", "box", "bottle", "spoon", "plate")
WORDS = {"say": "take this mug and put it next to this apple", "point_object": "t0", "point_target": "t2"}
PLACES = [(x, y) for x in (0.53, 0.7, 0.87) for y in (-0.37, -0.12, 0.13, 0.38)]


@pytest.fixture(scope="module")
def full_table():
    """A table of twelve things and the same with a hand that points."""
    things = [
        {"id": f"t{i}", "kind": kind, "x": x, "y": y, "yaw": 0.5 * i}
        for i, (kind, (x, y)) in enumerate(zip(KINDS, PLACES, strict=True))
    ]
    return takes({"objects": things, **WORDS}, 71, (None, "object"))


@pytest.fixture(scope="module")
def plain():
    return MediaPipeHands()


def least_ms(*calls, rounds=7):
    """Return the least processor time of calls [ms], taken by turns: what else the machine does only adds to it."""
    spent = [[] for _ in calls]
    for k in range(rounds + 1):
        for times, call in zip(spent, calls, strict=True):
            start = time.process_time()
            call(k)
            times.append(1e3 * (time.process_time() - start))
    return [min(times[1:]) for times in spent]


def test_twelve_things_are_found_in_the_time_of_a_few_plain_hand_calls(full_table, plain):
    """Detection with three phrases; it took five times a plain call before surfaces were split together."""
    empty, pointed = full_table
    detector = TabletopDetector()
    scene = detector.detect(RgbdFrame(empty.rgb, empty.depth, CAMERA, POSE), [])
    assert len(scene.detections) >= len(KINDS) - 1
    phrases = ["lemon", "red bowl", "objects"]
    detect, hands = least_ms(
        lambda _: detector.detect(RgbdFrame(empty.rgb, empty.depth, CAMERA, POSE), phrases),
        lambda _: plain.detect(pointed.rgb),
    )
    assert detect < max(140.0, 4.2 * hands)


def test_a_phrase_among_twelve_things_takes_little(full_table, plain):
    """Twenty more phrases cost less than two plain hand calls, or 2 ms each."""
    empty, pointed = full_table
    detector = TabletopDetector()
    words = [f"the biggest {colour} {kind}" for colour in ("red", "green") for kind in KINDS[:10]]
    few, many, hands = least_ms(
        lambda _: detector.detect(RgbdFrame(empty.rgb, empty.depth, CAMERA, POSE), []),
        lambda _: detector.detect(RgbdFrame(empty.rgb, empty.depth, CAMERA, POSE), words),
        lambda _: plain.detect(pointed.rgb),
    )
    assert many - few < max(20 * 2.0, 2.0 * hands)


def test_a_pointing_hand_takes_hardly_more_than_a_plain_hand_call(full_table, plain):
    """Second looks are for images in which something is missing; depth costs little."""
    _, pointed = full_table
    reader = make_reader(MediaPipeHands(), MediaPipeHands(lite=True))
    read, hands = least_ms(
        lambda k: reader.read(pointed.rgb, 1.0 + k / 30.0, depth=pointed.depth, camera=CAMERA),
        lambda _: plain.detect(pointed.rgb),
    )
    assert read < max(35.0, 1.5 * hands)
