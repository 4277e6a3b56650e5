# SPDX-License-Identifier: Apache-2.0
"""The renderer draws what a pinhole camera sees, as PyBullet's own does; the noise is that of a real sensor."""

import numpy as np
import pybullet
import pytest
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import invert
from uncom_sim.camera.noise import CameraNoise, NoisyCamera
from uncom_sim.camera.rasteriser import Rasteriser
from uncom_sim.camera.render_scene import RenderScene
from uncom_sim.camera.surfaces import from_bullet
from uncom_sim.camera.views import HEAD_CAMERA, look_at, overview_camera
from uncom_sim.types import Light

CAMERAS = [HEAD_CAMERA, overview_camera(400, 300), PinholeCamera(320, 240, 260, 260, 150, 130)]
LAMP = Light(direction=(0.3, 0.2, 1.0), colour=(1.0, 1.0, 1.0))
POSE = look_at((0.2, 0.02, 1.4), (0.8, 0.1, 0.7))


@pytest.fixture
def client():
    made = pybullet.connect(pybullet.DIRECT)
    yield made
    pybullet.disconnect(physicsClientId=made)


def _body(client, kind, place, colour, turn=(0, 0, 0, 1), **size):
    shape = pybullet.createVisualShape(kind, rgbaColor=[*colour, 1], physicsClientId=client, **size)
    return pybullet.createMultiBody(0, -1, shape, place, turn, physicsClientId=client)


def _draw(client, camera, pose, *, shadows=False):
    bodies = [pybullet.getBodyUniqueId(i, physicsClientId=client) for i in range(pybullet.getNumBodies(client))]
    render_scene = RenderScene(client, [surface for body in bodies for surface in from_bullet(client, body)])
    render_scene.update(LAMP.direction)
    rasteriser = Rasteriser(render_scene, (0.8, 0.0, 0.7), render_scene.faces())
    return rasteriser.render(camera, pose, LAMP, render_scene.faces(), shadows=shadows)


def _pybullets_depth(client, camera, pose, near=0.05, far=12.0):
    """Depth (H, W) [m] from PyBullet's own renderer, which samples at whole window coordinates."""
    c, projection = camera, np.zeros((4, 4))
    projection[0, 0], projection[0, 2] = 2.0 * c.fx / c.width, 1.0 - 2.0 * c.cx / c.width
    projection[1, 1], projection[1, 2] = 2.0 * c.fy / c.height, 2.0 * (c.cy + 1.0) / c.height - 1.0
    projection[2, 2], projection[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    projection[3, 2] = -1.0
    view = np.diag([1.0, -1.0, -1.0, 1.0]) @ invert(pose)
    buffer = pybullet.getCameraImage(
        c.width,
        c.height,
        view.T.reshape(-1).tolist(),
        projection.T.reshape(-1).tolist(),
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )[3]
    z = np.asarray(buffer, dtype=float).reshape(c.height, c.width)
    depth = far * near / (far - (far - near) * z)
    return np.where(depth > 0.999 * far, np.inf, depth)


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_small_ball_is_at_the_pixel_and_distance_that_the_camera_model_says(client, camera):
    rng = np.random.default_rng(2)
    for _ in range(6):
        pixel = rng.uniform((0.15 * camera.width, 0.15 * camera.height), (0.85 * camera.width, 0.85 * camera.height))
        distance = rng.uniform(0.6, 1.5)
        place = POSE[:3, :3] @ camera.deproject([pixel], [distance])[0] + POSE[:3, 3]
        ball = _body(client, pybullet.GEOM_SPHERE, place, (1, 0, 0), radius=0.02)
        rgb, depth = _draw(client, camera, POSE)
        rows, columns = np.nonzero(np.isfinite(depth))
        np.testing.assert_allclose((columns.mean(), rows.mean()), pixel, atol=0.35)
        assert depth[np.isfinite(depth)].min() == pytest.approx(distance - 0.02, abs=1e-3)
        assert rgb[rows, columns, 0].mean() > 4 * rgb[rows, columns, 2].mean()
        pybullet.removeBody(ball, physicsClientId=client)


def test_it_sees_the_same_distances_as_pybullets_renderer(client):
    rng = np.random.default_rng(5)
    _body(client, pybullet.GEOM_BOX, (0.7, 0, 0.70), (0.7, 0.6, 0.4), halfExtents=[0.25, 0.5, 0.02])
    _body(client, pybullet.GEOM_BOX, (0, 0, -0.01), (0.5, 0.5, 0.5), halfExtents=[4, 4, 0.01])
    for i in range(8):
        turn = pybullet.getQuaternionFromEuler(rng.uniform(-1, 1, 3).tolist())
        place = (0.5 + 0.05 * i, -0.4 + 0.1 * i, 0.8)
        kinds = (
            (pybullet.GEOM_BOX, {"halfExtents": [0.03, 0.05, 0.02]}),
            (pybullet.GEOM_SPHERE, {"radius": 0.04}),
            (pybullet.GEOM_CYLINDER, {"radius": 0.03, "length": 0.1}),
        )
        kind, size = kinds[i % 3]
        _body(client, kind, place, rng.random(3), turn, **size)
    _, depth = _draw(client, HEAD_CAMERA, POSE)
    reference = _pybullets_depth(client, HEAD_CAMERA, POSE)
    both = np.isfinite(depth) & np.isfinite(reference)
    assert both.mean() > 0.95
    error = np.abs(depth - reference)[both]
    assert np.quantile(error, 0.98) < 2e-3


def test_what_reaches_behind_the_camera_does_not_smear_over_the_picture(client):
    _body(client, pybullet.GEOM_BOX, (0, 0, -0.01), (0.5, 0.5, 0.5), halfExtents=[8, 8, 0.01])
    _body(client, pybullet.GEOM_BOX, (0.2, 0.02, 1.4), (0, 0, 1), halfExtents=[0.2, 0.2, 0.2])
    _, depth = _draw(client, HEAD_CAMERA, POSE)
    assert depth[5].min() > 1.0


def test_shadows_darken_what_the_lamp_does_not_see_and_nothing_else(client):
    _body(client, pybullet.GEOM_BOX, (0.7, 0, 0.70), (0.7, 0.6, 0.4), halfExtents=[0.25, 0.5, 0.02])
    _body(client, pybullet.GEOM_SPHERE, (0.7, 0.1, 0.92), (1, 0, 0), radius=0.05)
    lit, depth = _draw(client, HEAD_CAMERA, POSE)
    shaded, _ = _draw(client, HEAD_CAMERA, POSE, shadows=True)
    darker = lit[..., 1].astype(int) - shaded[..., 1].astype(int)
    point = np.array([0.7, 0.1, 0.92]) - 0.2 * np.array(LAMP.direction)
    u, v = HEAD_CAMERA.project([POSE[:3, :3].T @ (point - POSE[:3, 3])])[0].round().astype(int)
    assert darker[v, u] > 20
    assert (darker > 8).sum() < 0.05 * np.isfinite(depth).sum()
    assert darker.min() > -8


def test_moving_a_body_moves_its_picture(client):
    box = _body(client, pybullet.GEOM_BOX, (0.8, 0.1, 0.7), (0, 1, 0), halfExtents=[0.03, 0.03, 0.03])
    render_scene = RenderScene(client, from_bullet(client, box))
    rasteriser = Rasteriser(render_scene, (0.8, 0.0, 0.7), render_scene.faces())
    places = []
    for y in (0.1, 0.2):
        pybullet.resetBasePositionAndOrientation(box, (0.8, y, 0.7), (0, 0, 0, 1), physicsClientId=client)
        render_scene.update(LAMP.direction)
        _, depth = rasteriser.render(HEAD_CAMERA, POSE, LAMP, render_scene.faces(), shadows=True)
        places.append(np.nonzero(np.isfinite(depth))[1].mean())
    assert places[1] < places[0] - 30, "left of the robot is left in the picture"


def test_noise_repeats_with_seed_and_step_and_grows_with_distance():
    camera = NoisyCamera(CameraNoise(), 3, 480, 640)
    wall = np.full((480, 640), 1.0, np.float32)
    first, again, later = camera.measure(wall, 5), camera.measure(wall, 5), camera.measure(wall, 6)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, later, equal_nan=True)
    assert np.nanstd(first) == pytest.approx(0.0015, rel=0.05)
    assert np.nanstd(camera.measure(2.0 * wall, 5)) == pytest.approx(0.006, rel=0.05)
    grey = np.full((480, 640, 3), 128, np.uint8)
    assert 1.0 < camera.expose(grey, 1).std() < 3.0
    assert camera.expose(np.full_like(grey, 255), 1).max() == 255


def test_depth_is_unknown_outside_the_range_and_often_at_edges():
    camera = NoisyCamera(CameraNoise(), 3, 480, 640)
    depth = np.full((480, 640), 1.5, np.float32)
    depth[:100], depth[100:200], depth[200:300] = 0.2, 9.0, np.inf
    depth[300:, 320:] = 1.2
    measured = camera.measure(depth, 0)
    assert np.isnan(measured[:299]).all()
    assert np.isnan(measured[310:, 319:321]).mean() > 0.5
    assert np.isnan(measured[310:, 10:300]).mean() < 0.01


def test_a_noise_level_of_zero_is_a_perfect_camera():
    camera = NoisyCamera(CameraNoise().scaled(0.0), 0, 480, 640)
    depth = np.full((480, 640), 1.5, np.float32)
    depth[:, 320:] = 1.0
    np.testing.assert_array_equal(camera.measure(depth, 1), depth)
    grey = np.full((480, 640, 3), 128, np.uint8)
    np.testing.assert_array_equal(camera.expose(grey, 1), grey)
