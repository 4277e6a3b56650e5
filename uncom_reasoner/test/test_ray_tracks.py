# SPDX-License-Identifier: Apache-2.0
"""A hand stays one hand whatever the detector calls it; two hands stay two."""

from __future__ import annotations

import numpy as np
import pytest
from uncom_reasoner.gesture_types import RayObservation
from uncom_reasoner.pointing.ray_fusion import segment_dwells
from uncom_reasoner.pointing.ray_tracks import associate_rays
from uncom_reasoner.weights import load_weights

WIDTH = 640
DOWN = np.array([0.0, 1.0])


def ray(stamp_s, tip, name):
    tip = np.asarray(tip, dtype=float)
    return RayObservation(stamp_s, name, 0.9, 0.07, WIDTH, tip, tip - 40 * DOWN, DOWN, None)


def held(start_s, count, tip, names):
    dice = np.random.default_rng(5)
    return [ray(start_s + 0.125 * i, tip + dice.normal(0, 1.5, 2), names[i % len(names)]) for i in range(count)]


@pytest.mark.parametrize("names", [["left"], ["left", "right"], ["right", "right", "left"]])
def test_a_still_hand_is_one_look_whatever_it_is_called(names):
    (dwell,) = segment_dwells(held(10.0, 8, np.array([300.0, 200.0]), names), load_weights())
    assert len(dwell.stamps_s) == 8


def test_two_hands_that_swap_names_stay_two():
    left, right = np.array([150.0, 200.0]), np.array([450.0, 210.0])
    rays = []
    for i in range(8):
        names = ("left", "right") if i % 3 else ("right", "left")
        rays += [ray(10.0 + 0.1 * i, left, names[0]), ray(10.0 + 0.1 * i, right, names[1])]
    tracks = associate_rays(rays)
    assert [len(track) for track in tracks] == [8, 8]
    assert all(np.ptp([o.tip_px[0] for o in track]) == 0.0 for track in tracks)


def test_two_hands_of_one_name_in_one_image_are_two():
    rays = [ray(10.0 + 0.1 * i, tip, "left") for i in range(5) for tip in ([150.0, 200.0], [450.0, 200.0])]
    assert [len(track) for track in associate_rays(rays)] == [5, 5]


def test_a_hand_that_went_elsewhere_is_still_the_hand_of_its_name():
    rays = held(10.0, 5, np.array([150.0, 200.0]), ["left"]) + held(11.0, 5, np.array([450.0, 200.0]), ["left"])
    assert [len(track) for track in associate_rays(rays)] == [10]
    assert len(segment_dwells(rays, load_weights())) == 2
