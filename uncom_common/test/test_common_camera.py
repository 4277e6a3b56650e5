# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from uncom_common.camera import PinholeCamera
from uncom_common.exceptions import InvalidConfigError

CAMERA = PinholeCamera(640, 480, 522.19, 522.19, 320.5, 240.5)


@given(st.floats(0, 639), st.floats(0, 479), st.floats(0.3, 8.0))
def test_deprojected_pixel_projects_back(u, v, z):
    point = CAMERA.deproject([[u, v]], [z])
    assert np.allclose(CAMERA.project(point), [[u, v]], atol=1e-6)


def test_points_behind_the_camera_have_no_pixel():
    assert np.isnan(CAMERA.project([[0.1, 0.1, -1.0]])).all()


def test_ray_through_a_pixel_meets_the_points_seen_there():
    ray = CAMERA.ray((500, 60))
    point = CAMERA.deproject([[500, 60]], [2.0])[0]
    assert np.linalg.norm(np.cross(ray, point)) < 1e-9


@pytest.mark.parametrize("bad", [(0, 480, 500.0, 500.0), (640, 480, 0.0, 500.0), (640, 480, 500.0, -1.0)])
def test_cameras_that_cannot_project_are_refused(bad):
    with pytest.raises(InvalidConfigError):
        PinholeCamera(*bad, 320.0, 240.0)
