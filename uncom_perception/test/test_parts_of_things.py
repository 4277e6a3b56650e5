# SPDX-License-Identifier: Apache-2.0
"""What belongs to a thing: the painted inside of a cup, not what its smeared edge trails along the table."""

from __future__ import annotations

import numpy as np
import pytest
from uncom_perception.objects.attributes.object_geometry import clean_points
from uncom_perception.objects.segments.inside_test import is_inside
from uncom_perception.objects.segments.surface_fitting import is_neck

VIEWER = np.array([0.0, 0.0, 0.6])
AHEAD = np.array([0.8, 0.1])


def wall(middle, radius, height, *, near, low=0.0, seed=9100, count=1500):
    """Points of the half of an upright cylinder that is nearer to the viewer, or farther away from it."""
    rng = np.random.default_rng(seed)
    toward = np.arctan2(*(VIEWER[:2] - middle)[::-1]) + (0.0 if near else np.pi)
    angle = toward + rng.uniform(-1.4, 1.4, count)
    flat = middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.column_stack([flat, rng.uniform(low, height, count)])
    return (points + rng.normal(0.0, 0.0008, points.shape)).astype(np.float32)


def front(middle, width, height, seed=9101, count=1500):
    """Points of the front of a box that faces the viewer."""
    rng = np.random.default_rng(seed)
    ahead = (middle - VIEWER[:2]) / np.linalg.norm(middle - VIEWER[:2])
    flat = middle + rng.uniform(-width / 2, width / 2, count)[:, None] * np.array([-ahead[1], ahead[0]])
    return np.column_stack([flat, rng.uniform(0.0, height, count)]).astype(np.float32)


@pytest.mark.parametrize("radius", [0.035, 0.045, 0.08])
def test_the_far_wall_seen_over_a_rim_is_the_inside_of_the_near_one(radius):
    """Whatever it is painted; not the other way round."""
    outside = wall(AHEAD, radius, 0.1, near=True)
    inside = wall(AHEAD, radius, 0.1, near=False, low=0.06)
    assert is_inside(inside, outside, VIEWER)
    assert not is_inside(outside, inside, VIEWER)


def test_what_stands_behind_a_can_is_not_its_inside():
    """Another can bulges towards the viewer, a box is flat, and a ring far behind is another thing's."""
    outside = wall(AHEAD, 0.04, 0.1, near=True)
    behind = AHEAD * 1.1
    assert not is_inside(wall(behind, 0.04, 0.1, near=True, low=0.05), outside, VIEWER)
    assert not is_inside(front(behind, 0.07, 0.1), outside, VIEWER)
    assert not is_inside(wall(AHEAD * 1.3, 0.04, 0.1, near=False, low=0.06), outside, VIEWER)
    assert not is_inside(wall(AHEAD, 0.04, 0.16, near=False, low=0.12), outside, VIEWER)


def test_the_top_of_a_bottle_is_its_neck_and_a_ball_on_a_can_is_not():
    """A body that narrows has no top of its own; what stands on a can does not hide all of the can's."""
    body = wall(AHEAD, 0.03, 0.15, near=True)
    top = wall(AHEAD, 0.018, 0.19, near=True, low=0.152, count=400)
    assert is_neck(top, body)
    assert not is_neck(body, top)
    rng = np.random.default_rng(9105)
    lid = np.column_stack([AHEAD + rng.uniform(-0.025, 0.025, (900, 2)), np.full(900, 0.15)])
    assert not is_neck(top, np.concatenate([body, lid]).astype(np.float32))
    assert not is_neck(wall(AHEAD + 0.08, 0.018, 0.19, near=True, low=0.152, count=400), body)


@pytest.mark.parametrize("kind", ["trail", "strays"])
def test_a_things_extent_is_its_own(kind):
    """A thin trail on the table, and a few points far behind, make no mug longer."""
    body = np.concatenate([wall(AHEAD, 0.04, 0.1, near=True), wall(AHEAD, 0.04, 0.1, near=False, seed=9102)])
    rng = np.random.default_rng(9103)
    share = rng.uniform(0.0, 1.0, 60 if kind == "trail" else 12)[:, None]
    start, end = (0.045, 0.2) if kind == "trail" else (0.14, 0.15)
    way = AHEAD / np.linalg.norm(AHEAD)
    more = np.column_stack([AHEAD + (start + share * (end - start)) * way, 0.012 * np.ones(len(share))])
    if kind == "strays":
        more[:, 2] = 0.05
    points = np.concatenate([body, more]).astype(np.float32)[None]
    kept = clean_points(points, np.ones(points.shape[:2], bool))
    assert np.ptp(kept[:, 0]) < 0.095
    assert len(kept) > 0.97 * len(body)


def test_a_handle_in_the_air_and_a_low_thing_stay_whole():
    """A pan's handle is no trail, nor is the stem of a spoon."""
    rng = np.random.default_rng(9104)
    stem = np.column_stack(
        [0.84 + rng.uniform(0, 0.18, 700), 0.1 + rng.uniform(-0.008, 0.008, 700), np.full(700, 0.05)]
    )
    pan = np.concatenate([wall(AHEAD, 0.1, 0.06, near=True), wall(AHEAD, 0.1, 0.06, near=False, seed=5), stem])
    spoon = stem - np.array([0.0, 0.0, 0.045])
    for points in (pan, spoon):
        image = points.astype(np.float32)[None]
        kept = clean_points(image, np.ones(image.shape[:2], bool))
        assert np.ptp(kept[:, 0]) == pytest.approx(np.ptp(points[:, 0]), abs=0.012)
