# SPDX-License-Identifier: Apache-2.0
"""Finding a thing again in a new picture."""

from __future__ import annotations

import numpy as np
from uncom_perception.types import Detection, Scene

from uncom_tiago_exec.types import ManipulationTask
from uncom_tiago_exec.verification import extent, middle_of

_FOLLOW_M = 0.12  # [m] after a failed grasp the thing is looked for this far around its last place
_LIKE_SIZE = 0.5  # of the logarithm of two sizes


def nearest(scene: Scene, thing: Detection) -> Detection | None:
    """Return what stands nearest to a thing's place, if it is near enough to be the same."""
    place = middle_of(thing)
    seen = [d for d in scene.detections if d.geometry is not None]
    near = [(float(np.linalg.norm(middle_of(d) - place)), i) for i, d in enumerate(seen)]
    if not near or min(near)[0] > _FOLLOW_M:
        return None
    return seen[min(near)[1]]


def displaced(scene: Scene, task: ManipulationTask) -> Detection | None:
    """Return the thing of like size that stands where nothing stood before."""
    size = extent(task.object)
    known = [middle_of(d) for d in task.scene if d.geometry is not None and d.id != task.object.id]
    best: tuple[float, Detection] | None = None
    for seen in scene.detections:
        if seen.geometry is None or any(np.linalg.norm(middle_of(seen) - old) < 0.03 for old in known):
            continue
        misfit = abs(float(np.log(max(extent(seen), 1e-3) / max(size, 1e-3))))
        if misfit < _LIKE_SIZE and (best is None or misfit < best[0]):
            best = (misfit, seen)
    return best[1] if best else None
