# SPDX-License-Identifier: Apache-2.0
"""Which shapes of the robot can come near which obstacles in any configuration; other pairs need no check.

The centre of each shape stays within a distance of a vertical segment: the shoulder's path as the torso rises (or a
fixed point, for shapes that nothing moves). For a shape on the arm the distance is the sum of the lengths of the links
from the first joint of the arm to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from uncom_tiago_exec.robot.options import REACH_BOUNDS, ReachBoundOptions
from uncom_tiago_exec.types import Obstacle

_TORSO_LIFT, _FIRST_ARM_JOINT = 1, 2  # joint indices in the model of a group; 0 is the universe


class ReachBounds:
    """For each shape of a group the vertical segment that it stays within a distance of.

    Attributes:
        radius: those distances (G,), to the farthest point of the shape [m].
    """

    def __init__(
        self, model: Any, geometry: Any, lower: float, upper: float, *, options: ReachBoundOptions = REACH_BOUNDS
    ) -> None:
        """Bound all shapes of a group.

        Args:
            model: pinocchio model of torso and arm.
            geometry: its collision shapes.
            lower: least height of the torso joint [m].
            upper: greatest height of the torso joint [m].
            options: numbers that tune it.
        """
        segments, self.radius = [], np.zeros(len(geometry.geometryObjects))
        for i, solid in enumerate(geometry.geometryObjects):
            shape = solid.geometry
            shape.computeLocalAABB()
            centre = np.array(solid.placement.act(np.array(shape.aabb_center)))
            joint, radius = solid.parentJoint, float(shape.aabb_radius)
            if joint > _TORSO_LIFT:
                radius += float(np.linalg.norm(centre))
                while joint > _FIRST_ARM_JOINT:
                    radius += float(np.linalg.norm(model.jointPlacements[joint].translation))
                    joint = model.parents[joint]
                centre = np.array(model.jointPlacements[_FIRST_ARM_JOINT].translation)
            if joint > 0:
                centre = centre + np.array(model.jointPlacements[_TORSO_LIFT].translation)
            rise = np.array([[lower], [upper]]) if joint > 0 else np.zeros((2, 1))
            segments.append(centre + rise * [0.0, 0.0, 1.0])
            self.radius[i] = radius + options.slack_m
        self._low, self._high = np.array(segments)[:, 0], np.array(segments)[:, 1]

    def pairs_in_reach(self, obstacles: Sequence[Obstacle], margin: float) -> npt.NDArray[np.bool_]:
        """Return for each shape and obstacle (G, O) whether they can come within a margin [m] of one another.

        Obstacles, in base_footprint, are taken as their axis-aligned bounding boxes.
        """
        if not obstacles:
            return np.zeros((len(self.radius), 0), dtype=bool)
        centres = np.array([o.pose[:3, 3] for o in obstacles])
        half = np.array([np.abs(o.pose[:3, :3]) @ np.array(o.size) / 2.0 for o in obstacles])
        low, high = centres - half, centres + half
        gaps = np.maximum(np.maximum(low[None] - self._high[:, None], self._low[:, None] - high[None]), 0.0)
        return np.asarray(np.linalg.norm(gaps, axis=2) <= self.radius[:, None] + margin)
