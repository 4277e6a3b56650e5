# SPDX-License-Identifier: Apache-2.0
"""Which grasps hold: not those that press a thing out from between the pads, nor those that no finger fits around."""

import numpy as np
import pytest
from exec_gripper import GRIPPER, TABLE_Z
from uncom_tiago_exec.grasping.grasps import grasp_candidates
from uncom_tiago_exec.scene.object_shape import complete_shape

NOTHING = np.zeros((0, 3))


def turned(profile, rng, count=9000, x=0.62, y=-0.1):
    """What a camera at the robot's head sees of a surface of revolution with radii at heights (N, 2), closed on top."""
    profile = np.asarray(profile)
    height = rng.uniform(0.0, profile[-1, 1], count)
    radius = np.interp(height, profile[:, 1], profile[:, 0])
    around = rng.uniform(-np.pi, np.pi, count)
    side = np.column_stack([radius * np.cos(around), radius * np.sin(around), height])
    near = side[side[:, 0] < 0.25 * radius]
    return near + np.array([x, y, TABLE_Z]) + rng.normal(scale=0.0005, size=near.shape)


def mug(rng, handle, x=0.6, y=0.0, radius=0.04, height=0.095):
    """A mug seen from the robot: outside in front, inside behind, the edge, and a handle in a direction [rad]."""
    around, up = rng.uniform(-np.pi, np.pi, 6000), rng.uniform(0.0, height, 6000)
    outside = np.column_stack([radius * np.cos(around), radius * np.sin(around), up])
    outside = outside[outside[:, 0] < 0.0]
    inside = np.column_stack([(radius - 0.004) * np.cos(around), (radius - 0.004) * np.sin(around), up])
    inside = inside[(inside[:, 0] > 0.0) & (inside[:, 2] > 0.5 * height)]
    edge = np.column_stack([radius * np.cos(around), radius * np.sin(around), np.full(6000, height)])[:1500]
    out, aside = rng.uniform(0.0, 0.028, 900), rng.uniform(-0.005, 0.005, 900)
    grip = np.column_stack([radius + out, aside, rng.uniform(0.02, 0.075, 900)])
    c, s = np.cos(handle), np.sin(handle)
    grip[:, :2] = grip[:, :2] @ np.array([[c, s], [-s, c]])
    points = np.vstack([outside, inside, edge, grip])
    return points + np.array([x, y, TABLE_Z]) + rng.normal(scale=0.0005, size=points.shape)


@pytest.mark.parametrize("belly", [0.02, 0.026])
def test_what_narrows_upwards_is_held_at_its_belly(belly):
    """Pads of the best grasps reach as low as the widest place, and are as wide apart as it is."""
    rng = np.random.default_rng(3)
    pear = complete_shape("pear", turned([(0.018, 0.0), (0.032, belly), (0.016, 0.085), (0.006, 0.1)], rng), TABLE_Z)
    best = grasp_candidates(pear, NOTHING, GRIPPER)[:5]
    assert best
    for grasp in best:
        tip = grasp.pose[:3, 3] + GRIPPER.tip * grasp.approach
        lowest = tip[2] - GRIPPER.half_width * abs(grasp.pose[2, 2])
        assert lowest < TABLE_Z + belly + 0.003
        assert grasp.width > 2.0 * 0.03 - 0.004


@pytest.mark.parametrize("handle", [np.pi / 2, 2.5, -1.7])
def test_a_mug_is_as_wide_as_it_is_round_its_handle_left_out(handle):
    """The root of the handle does not widen it all around, so that a hand that just fits is found."""
    shape = complete_shape("mug", mug(np.random.default_rng(4), handle), TABLE_Z)
    assert shape.rim is not None
    families = {grasp.family for grasp in grasp_candidates(shape, NOTHING, GRIPPER, count=20)}
    assert families == {"across", "rim"}


def test_a_belly_under_a_narrower_edge_is_turned_with_the_rest():
    """What bulges beyond the edge in all directions that are seen bulges on the far side as well."""
    rng = np.random.default_rng(5)
    around, up = rng.uniform(-np.pi, np.pi, 8000), rng.uniform(0.0, 0.08, 8000)
    radius = 0.036 + 0.006 * np.sin(np.pi * up / 0.08)
    wall = np.column_stack([radius * np.cos(around), radius * np.sin(around), up])
    inner = np.column_stack([0.033 * np.cos(around), 0.033 * np.sin(around), up])
    seen = np.vstack([wall[wall[:, 0] < 0.0], inner[(inner[:, 0] > 0.0) & (up > 0.03)]])
    edge = np.column_stack([0.036 * np.cos(around), 0.036 * np.sin(around), np.full(8000, 0.08)])[:1500]
    shape = complete_shape("pot", np.vstack([seen, edge]) + np.array([0.6, 0.1, TABLE_Z]), TABLE_Z)
    behind = shape.points[shape.points[:, 0] > 0.62]
    assert np.linalg.norm(behind[:, :2] - [0.6, 0.1], axis=1).max() > 0.039
