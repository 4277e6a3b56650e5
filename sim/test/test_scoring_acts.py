# SPDX-License-Identifier: Apache-2.0
"""Pouring, holding out and pointing are judged by where the thing and the hands were on the way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from uncom_sim.bench_execution.cases import initial_states
from uncom_sim.objects.catalogue import natural_colour
from uncom_sim.scoring.acts import Moment, judge_act, opening_rim
from uncom_sim.scoring.end_state import PhysicalResult
from uncom_sim.types import Table
from uncom_sim.world.scene_file import scene_from_dict

TABLE = Table()
AWAY = np.eye(4)
AWAY[2, 3] = -5.0
THERE = PhysicalResult(True, "it is where it was", 0.0, 0.0)


def _things(*kinds):
    places = [(0.6, 0.2), (0.6, -0.1)]
    things = [
        {"id": f"o{i}", "kind": kind, "colour": natural_colour(kind), "x": x, "y": y, "yaw": 0.0}
        for i, (kind, (x, y)) in enumerate(zip(kinds, places, strict=False))
    ]
    return initial_states(scene_from_dict({"objects": things, "say": "do it"}))


def _tilted(thing, degrees, edge):
    """Return the pose (4, 4) of a thing tilted by an angle, with the lowest point of its mouth at a place (3,)."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("y", degrees, degrees=True).as_matrix()
    ring = opening_rim(thing) @ pose[:3, :3].T
    pose[:3, 3] = edge - ring[ring[:, 2].argmin()]
    return pose


def _pouring(thing, target, steepest, aside=0.0, above=0.05):
    edge = target.position + np.array([aside, 0.0, target.size[2] / 2.0 + above])
    angles = np.r_[np.linspace(0.0, steepest, 20), np.full(20, steepest), np.linspace(steepest, 0.0, 20)]
    return [Moment(0.1 * i, _tilted(thing, a, edge), target.pose, (AWAY, AWAY)) for i, a in enumerate(angles)]


@pytest.mark.parametrize("kind", ["mug", "cup", "bottle", "can"])
@pytest.mark.parametrize("into", ["bowl", "frying pan"])
def test_a_container_is_poured_out_only_when_tipped_far_enough_over_the_target(kind, into):
    thing, target = _things(kind, into)

    def judged(*how):
        return judge_act("pour", THERE, _pouring(thing, target, *how), (thing, target), frozenset(), TABLE)

    assert judged(110.0).success
    assert not judged(80.0).success
    assert "off o1" in judged(110.0, 0.2).reason
    assert not judged(110.0, 0.0, -0.05).success


def test_what_was_poured_has_to_stand_again_where_it_was():
    thing, target = _things("mug", "bowl")
    moved = PhysicalResult(True, "it is near", 0.09, 0.0)
    result = judge_act("pour", moved, _pouring(thing, target, 110.0), (thing, target), frozenset(), TABLE)
    assert not result.success
    assert "moved by 0.09 m" in result.reason


@pytest.mark.parametrize(
    ("height", "ahead", "tilt", "held", "success"),
    [
        (0.3, 0.6, 0.0, True, True),
        (0.05, 0.6, 0.0, True, False),
        (0.3, 0.3, 0.0, True, False),
        (0.3, 0.6, 1.0, True, False),
        (0.3, 0.6, 0.0, False, False),
    ],
)
def test_a_mug_is_given_when_it_is_held_out_level_high_and_ahead(height, ahead, tilt, held, success):
    (mug,) = _things("mug")
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("x", tilt).as_matrix()
    pose[:3, 3] = ahead, 0.1, TABLE.height + height + 0.06
    end = [Moment(1.0, pose, None, (AWAY, AWAY))]
    lifted = PhysicalResult(True, "o0 was lifted", height, 0.0)
    result = judge_act("give", lifted, end, (mug, None), frozenset({"o0"} if held else ()), TABLE)
    assert result.success is success


def test_a_finger_points_at_what_its_line_meets_from_near():
    (can,) = _things("can")
    top = np.array([*can.position[:2], TABLE.height + 0.115])

    def judged(offset, back):
        hand = np.eye(4)
        down = np.array([0.6, 0.0, -0.8])
        hand[:3, :3] = np.column_stack([down, [0.0, 1.0, 0.0], np.cross(down, [0.0, 1.0, 0.0])])
        hand[:3, 3] = top + np.array([0.0, offset, 0.0]) - back * down
        moments = [Moment(0.0, can.pose, None, (AWAY, AWAY)), Moment(1.0, can.pose, None, (hand, AWAY))]
        return judge_act("point", THERE, moments, (can, None), frozenset(), TABLE).success

    assert judged(0.0, 0.15)
    assert not judged(0.12, 0.15)
    assert not judged(0.0, 0.5)


def test_what_is_still_between_the_fingers_is_not_placed():
    (can,) = _things("can")
    result = judge_act("place", THERE, [], (can, None), frozenset({"o0"}), TABLE)
    assert not result.success
    assert "still between the fingers" in result.reason
