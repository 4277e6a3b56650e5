# SPDX-License-Identifier: Apache-2.0
"""The space behind things that the camera does not see: something low may stand there.

Motions keep out of it where there are others; what was asked for beside or behind a thing is done all the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from uncom_tiago_exec.scene.object_shape import ObjectShape
from uncom_tiago_exec.scene.obstacles import upright
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import FloatArray, Obstacle

_TALL = 0.07  # [m] what is lower hides hardly anything
_LOW = 0.03  # [m] what is lower than this is not expected to stand anywhere
_LONGEST = 0.25  # [m]
_PARTS = 2  # boxes that a shadow is made of, the farther the lower
_OWN = 0.06  # [m] around what the hand is to take or to leave, where it has to go


def shadows_of(scene: SceneModel, camera: FloatArray, goal: FloatArray | None) -> tuple[Obstacle, ...]:
    """Return boxes in the unseen space behind the things that stand still, as seen from a camera at (3,).

    The space around the thing to move, its target and its goal (2,) is left out.
    """
    own = [(scene.moved.middle[:2], _reach(scene.moved))]
    if scene.target is not None:
        own.append((scene.target.middle[:2], _reach(scene.target)))
    if goal is not None:
        own.append((goal, _reach(scene.moved)))
    still = [thing for thing in scene.others if thing.height > _TALL]
    return tuple(box for thing in still for box in _shadow(thing, camera) if not _meets(box, own))


def _reach(thing: ObjectShape) -> float:
    return 0.5 * float(np.linalg.norm(thing.size[:2])) + _OWN


def _shadow(thing: ObjectShape, camera: FloatArray) -> Iterator[Obstacle]:
    """Yield boxes from behind a thing to where the line of sight over its top comes down to what may stand there."""
    high = float(camera[2]) - thing.bottom
    if high <= thing.height:
        return
    away = thing.middle[:2] - camera[:2]
    ahead = away / max(float(np.linalg.norm(away)), 1e-6)
    local = thing.points[:, :2] - camera[:2]
    behind = float((local @ ahead).max())
    aside = local @ np.array([-ahead[1], ahead[0]])
    slope = (high - thing.height) / behind
    length = min((thing.height - _LOW) / slope, _LONGEST)
    for k in range(_PARTS):
        near = behind + k * length / _PARTS
        height = thing.height - (near - behind) * slope
        middle = camera[:2] + (near + 0.5 * length / _PARTS) * ahead
        middle = middle + 0.5 * float(aside.min() + aside.max()) * np.array([-ahead[1], ahead[0]])
        pose = upright(np.array([*middle, thing.bottom + 0.5 * height]), float(np.arctan2(ahead[1], ahead[0])))
        yield Obstacle(f"behind {thing.name}", "box", (length / _PARTS, float(np.ptp(aside)), height), pose)


def _meets(box: Obstacle, own: Sequence[tuple[FloatArray, float]]) -> bool:
    """Tell whether a box comes nearer to one of some places (2,) than its radius [m]."""
    for place, radius in own:
        local = box.pose[:2, :2].T @ (place - box.pose[:2, 3])
        outside = np.maximum(np.abs(local) - 0.5 * np.array(box.size[:2]), 0.0)
        if float(np.linalg.norm(outside)) < radius:
            return True
    return False
