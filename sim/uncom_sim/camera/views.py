# SPDX-License-Identifier: Apache-2.0
"""Where the cameras are and what they see: the robot's head camera and a bystander's view for the video."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from uncom_common.camera import PinholeCamera
from uncom_common.transforms import FloatArray

# The head camera of the robot (Orbbec Astra, as PAL's own simulation has it).
HEAD_CAMERA = PinholeCamera(640, 480, 522.19, 522.19, 320.5, 240.5)


def overview_camera(width: int, height: int) -> PinholeCamera:
    """Return a camera with a field of view of 50 degrees across the height."""
    focal = height / 2.0 / np.tan(np.radians(25.0))
    return PinholeCamera(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0)


def look_at(eye: npt.ArrayLike, target: npt.ArrayLike) -> FloatArray:
    """Return transform_optical_to_world (4, 4) of an upright camera at `eye` that looks at `target` [m]."""
    start = np.asarray(eye, dtype=float)
    forward = np.asarray(target, dtype=float) - start
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    matrix[:3, 3] = start
    return matrix
