# SPDX-License-Identifier: Apache-2.0
"""The base keeps its limits, stops when nobody commands it, and counts its wheels' turns."""

import numpy as np
import pytest
from uncom_sim.controllers.diff_drive import DiffDrive

STEP = 1.0 / 240.0


def _drive(base, seconds, now=0.0, command=None):
    outputs = []
    for i in range(round(seconds / STEP)):
        t = now + i * STEP
        if command is not None:
            base.command(*command, t)
        outputs.append(base.update(t, STEP))
        base.integrate(*outputs[-1], STEP)
    return np.array(outputs)


def test_it_speeds_up_no_faster_than_allowed_and_to_no_more_than_allowed():
    outputs = _drive(DiffDrive(), 3.0, command=(5.0, -9.0))
    assert outputs[:, 0].max() == pytest.approx(1.0)
    assert outputs[:, 1].min() == pytest.approx(-2.09)
    assert np.abs(np.diff(outputs, axis=0) / STEP).max(axis=0) == pytest.approx((1.0, 2.09), rel=1e-6)
    assert _drive(DiffDrive(), 2.0, command=(-5.0, 0.0))[:, 0].min() == pytest.approx(-0.2)


def test_it_stops_a_quarter_second_after_the_last_command():
    base = DiffDrive()
    _drive(base, 1.0, command=(0.2, 0.0))
    outputs = _drive(base, 1.0, now=1.0)
    assert outputs[round(0.2 / STEP), 0] == pytest.approx(0.2)
    assert outputs[-1, 0] == 0.0


def test_what_is_not_a_number_is_not_driven():
    base = DiffDrive()
    base.command(np.nan, 0.0, 0.0)
    assert base.update(0.0, STEP) == (0.0, 0.0)


def test_odometry_of_a_full_circle_comes_back_to_its_start():
    base = DiffDrive()
    steps = round(2 * np.pi / 0.5 / STEP)
    for _ in range(steps):
        base.integrate(0.2, 2 * np.pi / (steps * STEP), STEP)
    o = base.odometry
    assert (o.x, o.y) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert np.cos(o.yaw) == pytest.approx(1.0)
    left, right = o.wheels
    assert (right - left) * 0.0985 / 0.4044 == pytest.approx(2 * np.pi, rel=1e-6)
    assert (right + left) / 2 * 0.0985 == pytest.approx(0.2 * steps * STEP, rel=1e-6)
