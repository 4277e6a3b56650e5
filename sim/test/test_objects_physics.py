# SPDX-License-Identifier: Apache-2.0
"""Every kind of object stands, weighs, holds and looks as it should in PyBullet."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest
from uncom_sim.exceptions import SceneError
from uncom_sim.objects.body import body_pose, spawn
from uncom_sim.objects.catalogue import KINDS, colour_named, kind_named, model, natural_colour
from uncom_sim.objects.palette import COLOURS

TOP = 0.72
CONTAINERS = ("bowl", "mug", "cup", "frying pan", "plate")


@pytest.fixture
def client():
    connected = pybullet.connect(pybullet.DIRECT)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=connected)
    top = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[1, 1, 0.02], physicsClientId=connected)
    pybullet.createMultiBody(0, top, -1, [0, 0, TOP - 0.02], physicsClientId=connected)
    yield connected
    pybullet.disconnect(connected)


def _put(client, kind, x=0.0, y=0.0, above=0.0, yaw=0.3):
    shape = model(kind, natural_colour(kind))
    return spawn(client, shape, [x, y, TOP - shape.bounds[0, 2] + 0.001 + above], yaw), shape


def _run(client, seconds):
    for _ in range(round(seconds * 240)):
        pybullet.stepSimulation(physicsClientId=client)


@pytest.mark.parametrize("kind", KINDS)
def test_it_rests_where_it_is_put_with_its_weight(client, kind):
    body, shape = _put(client, kind)
    _run(client, 0.5)
    before = body_pose(client, body, shape.centre_of_mass)
    _run(client, 2.0)
    after = body_pose(client, body, shape.centre_of_mass)
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) < 0.002
    assert np.hypot(*after[:2, 3]) < 0.008
    assert after[2, 2] > np.cos(np.radians(4.0))
    assert pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[0] == pytest.approx(shape.mass)
    assert 0.03 < shape.mass < 1.0
    assert after[2, 3] + shape.bounds[0, 2] == pytest.approx(TOP, abs=0.003)


@pytest.mark.parametrize("container", CONTAINERS)
@pytest.mark.parametrize("yaw", [0.0, 0.9])
def test_a_lemon_dropped_into_it_stays_inside(client, container, yaw):
    body, shape = _put(client, container)
    _run(client, 0.2)
    lemon, lemon_shape = _put(client, "lemon", 0.004, -0.003, above=shape.size[2] + 0.02, yaw=yaw)
    _run(client, 2.5)
    place = (
        body_pose(client, lemon, lemon_shape.centre_of_mass)[:3, 3]
        - body_pose(client, body, shape.centre_of_mass)[:3, 3]
    )
    assert np.hypot(*place[:2]) < shape.opening.radius
    # Hollow: it lies on the floor of the container, not on a lid over its rim.
    assert place[2] - lemon_shape.size[2] / 2 < shape.opening.floor_z + 0.03
    assert place[2] > shape.opening.floor_z


@pytest.mark.parametrize("kind", ["apple", "orange", "can"])
def test_what_is_pushed_gently_does_not_roll_for_ever(client, kind):
    body, shape = _put(client, kind)
    _run(client, 0.2)
    pybullet.resetBaseVelocity(body, [0.15, 0, 0], [0, 0.15 / 0.036, 0], physicsClientId=client)
    _run(client, 3.0)
    assert np.linalg.norm(pybullet.getBaseVelocity(body, physicsClientId=client)[0]) < 0.005
    assert body_pose(client, body, shape.centre_of_mass)[0, 3] < 0.35


@pytest.mark.parametrize("kind", KINDS)
def test_surfaces_are_smooth_light_and_as_large_as_what_is_touched(kind):
    shape = model(kind, natural_colour(kind))
    assert sum(len(part.faces) for part in shape.parts) <= 3000
    for part in shape.parts:
        assert np.isfinite(part.vertices).all()
        assert np.allclose(np.linalg.norm(part.normals, axis=1), 1.0, atol=1e-3)
        assert part.faces.max() < len(part.vertices)
    touched = np.concatenate(shape.hulls)
    assert np.allclose(touched.min(axis=0), shape.bounds[0], atol=0.008)
    lower = shape.bounds[1] - (0, 0, 0.02 if kind in ("apple", "pear") else 0.0)  # a stem is too thin to touch
    assert (touched.max(axis=0) >= lower - 0.008).all()


def test_an_object_takes_any_named_colour():
    for colour, rgb in COLOURS.items():
        tile = model("bowl", colour).parts[0].tile
        assert np.allclose(tile.reshape(-1, 3).mean(axis=0) / 255.0, rgb, atol=0.01)


def test_names_are_forgiving_and_strangers_are_told_the_choices():
    assert kind_named("Frying-Pan") == "frying pan"
    assert colour_named("Gray") == "grey"
    with pytest.raises(SceneError, match="kinds are: banana, apple"):
        kind_named("teapot")
    with pytest.raises(SceneError, match="colours are: red, orange"):
        colour_named("ochre")
