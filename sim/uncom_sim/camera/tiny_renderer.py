# SPDX-License-Identifier: Apache-2.0
"""PyBullet's software renderer through a pinhole camera."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pybullet
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import FloatArray

from uncom_sim.camera.views import gl_view
from uncom_sim.types import Light

NEAR_M, FAR_M = 0.05, 12.0


def gl_projection(camera: PinholeCamera, near: float, far: float) -> list[float]:
    """Return OpenGL's projection matrix (16, column by column) of a pinhole camera.

    The renderer takes its samples at whole window coordinates, counting rows from the bottom.
    """
    c = camera
    matrix = np.zeros((4, 4))
    matrix[0, 0] = 2.0 * c.fx / c.width
    matrix[0, 2] = 1.0 - 2.0 * c.cx / c.width
    matrix[1, 1] = 2.0 * c.fy / c.height
    matrix[1, 2] = 2.0 * (c.cy + 1.0) / c.height - 1.0
    matrix[2, 2] = -(far + near) / (far - near)
    matrix[2, 3] = -2.0 * far * near / (far - near)
    matrix[3, 2] = -1.0
    return [float(v) for v in matrix.T.reshape(-1)]


def render(
    client: int, camera: PinholeCamera, optical_to_world: FloatArray, light: Light, *, shadow: bool = True
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """Return what a camera at transform_optical_to_world sees: rgb (H, W, 3), depth (H, W) [m], infinite if empty."""
    _, _, pixels, buffer, _ = pybullet.getCameraImage(
        camera.width,
        camera.height,
        gl_view(optical_to_world),
        gl_projection(camera, NEAR_M, FAR_M),
        shadow=int(shadow),
        lightDirection=list(light.direction),
        lightColor=list(light.colour),
        lightDistance=light.distance,
        lightAmbientCoeff=light.ambient,
        lightDiffuseCoeff=light.diffuse,
        lightSpecularCoeff=light.specular,
        flags=pybullet.ER_NO_SEGMENTATION_MASK,
        renderer=pybullet.ER_TINY_RENDERER,
        physicsClientId=client,
    )
    rgba = np.asarray(pixels, dtype=np.uint8).reshape(camera.height, camera.width, 4)
    z = np.asarray(buffer, dtype=np.float64).reshape(camera.height, camera.width)
    depth = FAR_M * NEAR_M / (FAR_M - (FAR_M - NEAR_M) * z)
    depth[depth > 0.999 * FAR_M] = np.inf
    return np.ascontiguousarray(rgba[..., :3]), depth.astype(np.float32)
