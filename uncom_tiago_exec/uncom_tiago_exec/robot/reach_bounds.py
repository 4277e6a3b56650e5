# SPDX-License-Identifier: Apache-2.0
"""Which links can come near which solids at all, whatever the joints do: pairs that cannot need no check."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from uncom_tiago_exec.robot.options import REACH_BOUNDS, ReachBoundOptions
from uncom_tiago_exec.types import Obstacle


class ReachBounds:
    """For each shape of a group: the vertical line its middle is always within a distance of, as the torso rises."""

    def __init__(
        self, model: Any, geometry: Any, lower: float, upper: float, *, options: ReachBoundOptions = REACH_BOUNDS
    ) -> None:
        """Bound the shapes of a pinocchio model and its geometry; lower and upper are the torso's limits [m]."""
        self._options = options
        first = 2  # joint of the arm in the model, after the universe (0) and the torso's lift (1)
        lines, self.radius = [], np.zeros(len(geometry.geometryObjects))
        for i, thing in enumerate(geometry.geometryObjects):
            shape = thing.geometry
            shape.computeLocalAABB()
            middle = np.array(thing.placement.act(np.array(shape.aabb_center)))
            joint, far = thing.parentJoint, float(shape.aabb_radius)
            if joint > 1:  # turns about joints of the arm: within the length of the chain from the first of them
                far += float(np.linalg.norm(middle))
                while joint > first:
                    far += float(np.linalg.norm(model.jointPlacements[joint].translation))
                    joint = model.parents[joint]
                middle = np.array(model.jointPlacements[first].translation)
            if joint > 0:
                middle = middle + np.array(model.jointPlacements[1].translation)
            rise = np.array([[lower], [upper]]) if joint > 0 else np.zeros((2, 1))
            lines.append(middle + rise * [0.0, 0.0, 1.0])
            self.radius[i] = far + self._options.slack_m
        self._low, self._high = np.array(lines)[:, 0], np.array(lines)[:, 1]

    def near(self, obstacles: Sequence[Obstacle], margin: float) -> npt.NDArray[np.bool_]:
        """Return for each shape and obstacle (G, O) whether they can come as near as a margin [m]."""
        if not obstacles:
            return np.zeros((len(self.radius), 0), dtype=bool)
        middles = np.array([o.pose[:3, 3] for o in obstacles])
        half = np.array([np.abs(o.pose[:3, :3]) @ np.array(o.size) / 2.0 for o in obstacles])
        low, high = middles - half, middles + half
        gaps = np.maximum(np.maximum(low[None] - self._high[:, None], self._low[:, None] - high[None]), 0.0)
        return np.asarray(np.linalg.norm(gaps, axis=2) <= self.radius[:, None] + margin)
