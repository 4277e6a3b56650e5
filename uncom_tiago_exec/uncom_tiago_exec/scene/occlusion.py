# SPDX-License-Identifier: Apache-2.0
"""The space behind objects that the camera does not see: something low may stand there.

Motions keep out of it where there are others; what was asked for beside or behind an object is done all the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.obstacles import make_upright_pose
from uncom_tiago_exec.scene.options import SHADOWS, ShadowOptions
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import FloatArray, Obstacle


def find_occluded_space(
    scene: SceneModel, camera: FloatArray, goal: FloatArray | None, options: ShadowOptions = SHADOWS
) -> tuple[Obstacle, ...]:
    """Return boxes in the unseen space behind the objects that stand still, as seen from a camera at (3,).

    The space around the object to move, its target and its goal (2,) is left out.
    """
    kept_free = [(scene.moved.middle[:2], _radius_kept_free(scene.moved, options))]
    if scene.target is not None:
        kept_free.append((scene.target.middle[:2], _radius_kept_free(scene.target, options)))
    if goal is not None:
        kept_free.append((goal, _radius_kept_free(scene.moved, options)))
    still = [shape for shape in scene.others if shape.height > options.tall_m]
    return tuple(
        box for shape in still for box in _occluded_boxes(shape, camera, options) if not _meets(box, kept_free)
    )


def _radius_kept_free(shape: ObjectShape, options: ShadowOptions) -> float:
    """Return the radius around an object, or its place, in which the hand has to move [m]."""
    return 0.5 * float(np.linalg.norm(shape.size[:2])) + options.own_space_m


def _occluded_boxes(shape: ObjectShape, camera: FloatArray, options: ShadowOptions) -> Iterator[Obstacle]:
    """Yield boxes from behind an object to where the line of sight over its top comes down to what may stand there."""
    high = float(camera[2]) - shape.bottom
    if high <= shape.height:
        return
    away = shape.middle[:2] - camera[:2]
    ahead = away / max(float(np.linalg.norm(away)), 1e-6)
    local = shape.points[:, :2] - camera[:2]
    behind = float((local @ ahead).max())
    aside = local @ np.array([-ahead[1], ahead[0]])
    slope = (high - shape.height) / behind
    length = min((shape.height - options.hidden_height_m) / slope, options.longest_m)
    count = options.boxes
    for k in range(count):
        near = behind + k * length / count
        height = shape.height - (near - behind) * slope
        middle = camera[:2] + (near + 0.5 * length / count) * ahead
        middle = middle + 0.5 * float(aside.min() + aside.max()) * np.array([-ahead[1], ahead[0]])
        pose = make_upright_pose(
            np.array([*middle, shape.bottom + 0.5 * height]), float(np.arctan2(ahead[1], ahead[0]))
        )
        yield Obstacle(f"behind {shape.name}", "box", (length / count, float(np.ptp(aside)), height), pose)


def _meets(box: Obstacle, places: Sequence[tuple[FloatArray, float]]) -> bool:
    """Tell whether a box comes nearer to one of some places (2,) than its radius [m]."""
    for place, radius in places:
        local = box.pose[:2, :2].T @ (place - box.pose[:2, 3])
        outside = np.maximum(np.abs(local) - 0.5 * np.array(box.size[:2]), 0.0)
        if float(np.linalg.norm(outside)) < radius:
            return True
    return False
