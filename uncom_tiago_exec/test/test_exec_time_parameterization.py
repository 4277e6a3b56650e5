# SPDX-License-Identifier: Apache-2.0
"""Timed motions keep the limits of every joint, at the speeds of a TIAGo's torso and arm."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from uncom_tiago_exec.trajectory.time_parameterization import MotionLimits, time_path

JOINTS = ("torso_lift_joint", *(f"arm_left_{k}_joint" for k in range(1, 8)))
VELOCITY = np.array([0.07, 1.95, 1.95, 2.35, 2.35, 1.95, 1.76, 1.76])  # [m/s], [rad/s]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 12))
def test_timed_motion_keeps_all_limits_and_does_not_stop(seed, count):
    """Sampled at 1 kHz, velocity, acceleration and jerk stay within limits; inner waypoints are not stops."""
    rng = np.random.default_rng(seed)
    limits = MotionLimits(VELOCITY, np.array([0.25] + [3.0] * 7))
    waypoints = np.cumsum(rng.normal(size=(count, 8)) * ([0.02] + [0.5] * 7), axis=0)
    motion = time_path(JOINTS, waypoints, limits, rate_hz=500.0)
    dt = motion.times[1]
    inner = slice(0, -1)
    acceleration = np.diff(motion.velocities[inner], axis=0) / dt
    jerk = np.diff(acceleration, axis=0) / dt
    assert (np.abs(motion.velocities) <= limits.velocity * 1.001).all()
    assert (np.abs(acceleration) <= limits.acceleration * 1.001).all()
    assert (np.abs(jerk) <= limits.jerk * 1.02).all()
    assert np.allclose(motion.positions[0], waypoints[0])
    assert np.allclose(motion.positions[-1], waypoints[-1])
    speed = np.abs(motion.velocities / limits.velocity).max(axis=1)
    middle = (motion.times > 0.3) & (motion.times < motion.times[-1] - 0.3)
    assert not middle.any() or speed[middle].min() > 1e-3


def test_sampled_velocities_are_the_derivative_of_the_positions():
    limits = MotionLimits(np.ones(2), np.ones(2))
    motion = time_path(("a", "b"), np.array([[0.0, 0.0], [1.0, 0.2], [1.0, 1.0]]), limits, rate_hz=500.0)
    slope = np.gradient(motion.positions[:-1], motion.times[:-1], axis=0)
    assert np.abs(slope[1:-1] - motion.velocities[1:-2]).max() < 0.01
