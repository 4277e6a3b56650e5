# SPDX-License-Identifier: Apache-2.0
"""The scorer says what physics says: in, on, beside, in a place, lifted, fallen, disturbed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.catalogue import model, natural_colour
from uncom_sim.scoring.end_state import judge, nearest_object
from uncom_sim.types import Meaning, ObjectState, Table

TABLE = Table()


def _state(name, kind, x, y, z=None, tilt=0.0):
    shape = model(kind, natural_colour(kind))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("x", tilt).as_matrix()
    pose[:3, 3] = (x, y, TABLE.height - shape.bounds[0, 2] if z is None else z)
    return ObjectState(name, kind, natural_colour(kind), pose, shape.size)


BOWL = _state("bowl", "bowl", 0.6, -0.1)
BOX = _state("box", "box", 0.6, -0.1)
LEMON = _state("lemon", "lemon", 0.6, 0.2)
APPLE = _state("apple", "apple", 0.7, 0.35)


def _judge(goal, thing, *others, before=None):
    start = before if before is not None else (LEMON, *others)
    return judge(start, (thing, *others), goal, TABLE)


def test_inside_a_bowl_counts_and_beside_it_or_at_its_side_does_not():
    goal = Meaning("lemon", "in", "bowl")
    inside = _judge(goal, _state("lemon", "lemon", 0.61, -0.11, 0.76), BOWL)
    assert inside.success
    assert inside.reason == "lemon is in bowl"
    assert inside.object_moved_m == pytest.approx(0.31, abs=0.01)
    assert inside.others_moved_m == 0.0
    assert not _judge(goal, LEMON, BOWL).success
    assert not _judge(goal, _state("lemon", "lemon", 0.6, 0.02), BOWL).success
    assert not _judge(goal, _state("lemon", "lemon", 0.6, -0.1, 0.95), BOWL).success
    tipped = _state("bowl", "bowl", 0.6, -0.1, tilt=1.5)
    assert "tipped" in judge((LEMON, BOWL), (_state("lemon", "lemon", 0.6, -0.1, 0.75), tipped), goal, TABLE).reason


def test_on_a_box_counts_only_when_it_lies_on_top():
    goal = Meaning("lemon", "on", "box")
    assert _judge(goal, _state("lemon", "lemon", 0.6, -0.1, TABLE.height + 0.09 + 0.027), BOX).success
    assert not _judge(goal, _state("lemon", "lemon", 0.6, 0.02), BOX).success


@pytest.mark.parametrize(
    ("relation", "dx", "dy"),
    [("left_of", 0.0, 0.16), ("right_of", 0.0, -0.16), ("in_front_of", -0.14, 0.0), ("behind", 0.16, 0.0)],
)
def test_each_side_of_a_box_is_its_own_and_no_other(relation, dx, dy):
    there = _state("lemon", "lemon", 0.6 + dx, -0.1 + dy)
    for asked in ("left_of", "right_of", "in_front_of", "behind"):
        assert _judge(Meaning("lemon", asked, "box"), there, BOX).success == (asked == relation)
    assert _judge(Meaning("lemon", "next_to", "box"), there, BOX).success


def test_far_away_is_not_beside():
    far = _judge(Meaning("lemon", "left_of", "box"), _state("lemon", "lemon", 0.6, 0.45), BOX)
    assert not far.success
    assert "too far" in far.reason


def test_a_place_is_reached_within_its_radius():
    goal = Meaning("lemon", "area", None, (0.6, -0.2))
    assert _judge(goal, _state("lemon", "lemon", 0.65, -0.18)).success
    assert not _judge(goal, LEMON).success


def test_lifting_falling_and_disturbing_are_told():
    assert _judge(Meaning("lemon", "none"), _state("lemon", "lemon", 0.6, 0.2, 1.0)).success
    assert not _judge(Meaning("lemon", "none"), LEMON).success
    assert "fell" in _judge(Meaning("lemon", "in", "bowl"), _state("lemon", "lemon", 0.3, 0.2, 0.03), BOWL).reason
    moved = _state("apple", "apple", 0.7, 0.2)
    done = judge(
        (LEMON, BOWL, APPLE),
        (_state("lemon", "lemon", 0.6, -0.1, 0.76), BOWL, moved),
        Meaning("lemon", "in", "bowl"),
        TABLE,
    )
    assert not done.success
    assert "apple was moved by 0.15 m" in done.reason
    assert done.as_dict()["others_moved_m"] == pytest.approx(0.15)


def test_things_are_found_by_place_and_empty_places_are_empty():
    states = (LEMON, BOWL, APPLE)
    assert nearest_object(states, 0.61, 0.21) == "lemon"
    assert nearest_object(states, 0.66, -0.12) == "bowl"
    assert nearest_object(states, 0.85, -0.4) is None
    inside = (_state("lemon", "lemon", 0.61, -0.11, 0.76), BOWL)
    assert nearest_object(inside, 0.615, -0.112) == "lemon"


def test_a_goal_that_names_a_stranger_is_refused():
    with pytest.raises(SceneError, match="no object 'cup' to judge; objects are: lemon"):
        _judge(Meaning("cup", "none"), LEMON)


@pytest.mark.parametrize("tilt", [0.0, 0.9, 1.7, 2.6])
def test_what_has_tipped_over_lies_on_the_table_however_it_leans(tilt):
    pear = _state("pear", "pear", 0.6, -0.2, 0.0, tilt)
    corners = np.concatenate(model("pear", natural_colour("pear")).hulls)
    down = float((corners @ pear.pose[2, :3]).min())
    goal = Meaning("pear", "area", None, (0.6, -0.2))
    for lift, lies in ((0.0, True), (0.05, False)):
        there = _state("pear", "pear", 0.6, -0.2, TABLE.height - down + lift, tilt)
        assert _judge(goal, there, before=(_state("pear", "pear", 0.6, 0.2),)).success is lies


def test_a_bottle_that_lies_is_not_placed_and_a_pear_that_lies_is():
    for kind, success in (("bottle", False), ("pear", True)):
        radius = 0.5 * float(model(kind, natural_colour(kind)).size[1])
        before = (_state("thing", kind, 0.6, 0.2), BOX)
        after = (_state("thing", kind, 0.6, -0.2, TABLE.height + radius, np.pi / 2.0), BOX)
        result = judge(before, after, Meaning("thing", "area", None, (0.6, -0.2)), TABLE)
        assert result.success is success, result.reason
