# SPDX-License-Identifier: Apache-2.0
"""Hands over time: losses that are bridged, still scenes that cost nothing, styles of pointing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from perception_scenes import takes
from uncom_perception.hands.detection.detector import HandDetector, RawHand
from uncom_perception.hands.detection.hand_finder import HandFinder
from uncom_perception.hands.detection.mediapipe_hands import MediaPipeHands
from uncom_perception.hands.gesture_reader import STYLES, make_reader, pointing_evidence
from uncom_perception.hands.hand_bridge import HandBridge
from uncom_perception.types import Hand, HandsFrame, MetricRay, PointingRay

SCENE = {
    "objects": [{"id": "a", "kind": "mug", "x": 0.6, "y": 0.1}, {"id": "b", "kind": "bowl", "x": 0.6, "y": -0.2}],
    "say": "put this mug in this bowl",
    "point_object": "a",
    "point_target": "b",
}


def frame(stamp_s, angle=None, shift=0.0, handedness="right"):
    """Hands of one image: none, or one that points at an angle [rad] from a place shifted by some pixels."""
    if angle is None:
        return HandsFrame(stamp_s, "camera", 640, 480, ())
    direction = np.array([np.cos(angle), np.sin(angle)])
    origin = np.array([200.0 + shift, 200.0])
    tip = origin + 40.0 * direction
    marks = np.column_stack([np.linspace(150, 250, 21) + shift, np.linspace(160, 240, 21), np.zeros(21)])
    metric = MetricRay(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.1, 1.0]), np.array([*direction, 0.0]))
    ray = PointingRay(tuple(origin), tuple(tip), tuple(direction), 0.05, metric)
    return HandsFrame(stamp_s, "camera", 640, 480, (Hand(handedness, 0.9, marks, ray, 1.0),), 0)


def sent(frames, longest_s=0.25):
    bridge = HandBridge(longest_s)
    return [ready for f in frames for ready in bridge.add(f)]


def test_a_short_loss_is_bridged_with_growing_uncertainty():
    """The ray lies between the two that were seen, its sigma is largest in the middle of the gap."""
    out = sent([frame(1.0, 0.0), frame(1.05), frame(1.1), frame(1.15), frame(1.2, 0.2)])
    assert [f.stamp_s for f in out] == [1.0, 1.05, 1.1, 1.15, 1.2]
    rays = [f.hands[0].ray for f in out]
    angles = [np.arctan2(r.direction[1], r.direction[0]) for r in rays]
    assert np.all(np.diff(angles) > 0.0)
    sigmas = [r.sigma_rad for r in rays]
    assert sigmas[2] > sigmas[1] > sigmas[0]
    assert sigmas[2] > sigmas[3] > sigmas[4]
    assert out[2].hands[0].score < out[0].hands[0].score
    assert "bridged" in out[2].backend


@pytest.mark.parametrize(
    "after", [frame(1.2, 0.0, shift=300.0), frame(1.2, 2.0), frame(1.2, 0.0, handedness="left"), frame(2.0, 0.0)]
)
def test_a_hand_that_is_elsewhere_or_other_or_late_is_not_invented(after):
    """The images in between stay without hands."""
    out = sent([frame(1.0, 0.0), frame(1.05), frame(1.1), after])
    assert [len(f.hands) for f in out] == [1, 0, 0, 1]


def test_nothing_is_held_back_for_longer_than_is_bridged():
    """A hand that leaves is gone after the longest bridge, and every image goes out once, in order."""
    stamps = [1.0 + 0.05 * i for i in range(12)]
    bridge, out, late = HandBridge(0.2), [], []
    for stamp in stamps:
        ready = bridge.add(frame(stamp, 0.0 if stamp == 1.0 else None))
        late += [stamp - f.stamp_s for f in ready]
        out += ready
    assert [f.stamp_s for f in out] == stamps
    assert max(late) <= 0.25
    assert all(not f.hands for f in out[1:])


class Counting(HandDetector):
    """Passes on to a real detector and counts the looks."""

    def __init__(self, inner):
        self.inner, self.looks = inner, 0

    @property
    def name(self):
        return self.inner.name

    def detect(self, image_rgb):
        self.looks += 1
        return self.inner.detect(image_rgb)


@pytest.fixture(scope="module")
def stream():
    return takes(SCENE, 4, (None, "object"))


def test_a_still_scene_is_hardly_looked_at_and_a_hand_is_found_at_once(stream):
    """Ten images a second without change cost two or three looks; the first image with a hand shows it."""
    detector = Counting(MediaPipeHands())
    reader = make_reader(detector)
    for i in range(20):
        reader.read(stream[0].rgb, 10.0 + 0.1 * i)
    before = detector.looks
    for i in range(20, 40):
        assert not reader.read(stream[0].rgb, 10.0 + 0.1 * i).hands
    assert detector.looks - before <= 12
    assert reader.read(stream[1].rgb, 14.0).hands


def test_while_somebody_speaks_every_image_is_looked_at(stream):
    """An expected hand is looked for in a still scene, too."""
    detector = Counting(MediaPipeHands())
    finder = HandFinder(detector)
    for i in range(20):
        finder.find(stream[0].rgb, 10.0 + 0.1 * i)
    finder.expect(13.0)
    before = detector.looks
    for i in range(20, 30):
        finder.find(stream[0].rgb, 10.0 + 0.1 * i)
    assert detector.looks - before >= 10


class Curling(HandDetector):
    """Passes on to a real detector, but sees every index finger curled up."""

    def __init__(self, inner):
        self.inner = inner

    @property
    def name(self):
        return self.inner.name

    def detect(self, image_rgb):
        return tuple(self._curled(hand) for hand in self.inner.detect(image_rgb))

    def _curled(self, hand):
        parts = []
        for marks in (hand.landmarks, hand.world):
            bent = marks.copy()
            bent[[6, 7, 8]] = marks[5] + 0.05 * (marks[[6, 7, 8]] - marks[5])
            parts.append(bent)
        return replace(hand, landmarks=parts[0], world=parts[1])


def test_where_one_model_misjudges_the_finger_cuts_of_the_other_show_it(stream):
    """A pointing hand points though the larger model takes it for a fist, at each look, in whatever cut."""
    reader = make_reader(Curling(MediaPipeHands()), lite=MediaPipeHands(lite=True))
    seen = reader.read(stream[1].rgb, 10.0)
    assert seen.pointing_hand is not None


def flat_hand(spread_rad):
    """A hand with all fingers straight, fanned out by an angle from finger to finger."""
    marks = np.zeros((21, 3))
    bases = {"thumb": (-0.03, 0.03, -0.9), "index": (-0.025, 0.09), "middle": (0.0, 0.095), "ring": (0.02, 0.09)}
    for k, name in enumerate(("thumb", "index", "middle", "ring", "little")):
        first = 1 + 4 * k
        base = np.array(bases.get(name, (0.04, 0.08))[:2])
        angle = -0.9 if name == "thumb" else (k - 2) * spread_rad
        for joint in range(4):
            marks[first + joint, :2] = base + joint * 0.027 * np.array([np.sin(angle), np.cos(angle)])
    return RawHand("right", 0.9, marks * 1000.0, marks)


def test_the_whole_hand_points_only_where_that_style_is_asked_for():
    """A flat hand with closed fingers points along the middle finger by "hand", not by the others; spread, never."""
    together, spread = flat_hand(0.0), flat_hand(0.3)
    default = [STYLES[name]() for name in ("index", "two_fingers")]
    whole = [*default, STYLES["hand"]()]
    assert pointing_evidence(default, together)[0] < 0.4
    score, style = pointing_evidence(whole, together)
    assert score > 0.4
    assert style.name == "hand"
    assert style.line[-1] == 12
    assert pointing_evidence(whole, spread)[0] < 0.4


def test_time_that_jumps_back_starts_anew():
    """A bag that is played again is bridged and looked at from its beginning."""
    out = sent([frame(5.0, 0.0), frame(1.0), replace(frame(1.1, 0.0))])
    assert [f.stamp_s for f in out] == [5.0, 1.0, 1.1]
