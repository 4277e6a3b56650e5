# SPDX-License-Identifier: Apache-2.0
"""Straight joint motions are timed by Ruckig within their limits and stay on the line."""

import numpy as np
import pytest
from uncom_tiago_exec.exceptions import PlanningError
from uncom_tiago_exec.trajectory.rest_to_rest import is_straight, time_straight
from uncom_tiago_exec.trajectory.time_parameterization import MotionLimits, time_path

LIMITS = MotionLimits(np.array([0.07, 1.9, 2.3]), np.array([0.25, 3.0, 3.0]))
NAMES = ("torso", "one", "two")


@pytest.mark.parametrize("seed", range(5))
def test_motion_stays_on_the_line_and_within_the_limits(seed):
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-1, 1, 3) * [0.1, 1, 1], rng.uniform(-1, 1, 3) * [0.1, 1, 1]
    times, positions, velocities = time_straight(start, end, (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk), 500)
    line = (end - start) / np.linalg.norm(end - start)
    beside = (positions - start) - ((positions - start) @ line)[:, None] * line
    assert np.abs(beside).max() < 1e-9
    assert np.allclose(positions[-1], end)
    assert np.allclose(velocities[[0, -1]], 0.0, atol=1e-9)
    assert (np.abs(velocities) <= LIMITS.velocity + 1e-9).all()
    acceleration = np.diff(velocities, axis=0)[:-1] / np.diff(times)[:-1, None]
    assert (np.abs(acceleration) <= LIMITS.acceleration * 1.001).all()
    jerk = np.diff(acceleration, axis=0) * 500
    assert (np.abs(jerk) <= LIMITS.jerk * 1.01).all()


def test_a_straight_path_with_waypoints_on_it_takes_no_longer_than_its_ends_alone():
    ends = np.array([[0.0, 0.0, 0.0], [0.05, 1.0, -0.5]])
    waypoints = ends[0] + np.linspace(0, 1, 7)[:, None] * (ends[1] - ends[0])
    assert is_straight(waypoints)
    assert time_path(NAMES, waypoints, LIMITS).times[-1] == pytest.approx(time_path(NAMES, ends, LIMITS).times[-1])


def test_a_corner_and_a_way_back_are_not_straight():
    assert not is_straight(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]))
    assert not is_straight(np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0]]))
    assert not is_straight(np.zeros((2, 3)))


def test_impossible_limits_are_an_error_in_words():
    with pytest.raises(PlanningError, match="straight motion"):
        time_straight(np.zeros(1), np.ones(1), (np.array([0.0]), np.ones(1), np.ones(1)), 50)
