# SPDX-License-Identifier: Apache-2.0
"""A grasp that works from start to end, as joint paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.grasping.place_poses import Place
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.types import FloatArray


@dataclass(frozen=True, slots=True)
class Reach:
    """A grasp that works: joint paths for each straight part, and where it is let go."""

    arm: ArmPlanner
    grasp: Grasp
    approach: FloatArray
    lift: FloatArray
    place: Place | None = None
    lower: FloatArray | None = None
    retreat: FloatArray | None = None
    release_gap: float = 0.0
    over: FloatArray | None = None  # from the lifted thing to above its place, where a straight way leads there

    @property
    def carrying_pace(self) -> float:
        """Share of the full pace at which the thing is carried: doubtful grasps and long pendulums are not shaken."""
        pads = self.grasp.pose[2, 3] + self.arm.group.gripper.tip * self.grasp.approach[2]
        lever = abs(float(pads - self.arm.scene.moved.middle[2]))
        swing = 1.0 / (1.0 + 8.0 * max(0.0, lever - 0.03))
        return float(np.clip((0.35 + 0.7 * self.grasp.quality) * swing, 0.45, 0.9))

    def hop(self) -> float:
        """Rough time from the lifted thing to above its place [s]."""
        if self.lower is None:
            return 0.0
        way = np.vstack([self.lift[-1], self.lower[0]]) if self.over is None else self.over
        return float((np.abs(np.diff(way, axis=0)) / self.arm.limits.velocity).max(axis=1).sum())

    def cost(self) -> float:
        """Rough time of the free motions, dearer for doubtful grasps: what is lost costs more than a way [s]."""
        speed = self.arm.limits.velocity
        hops = [(self.arm.start, self.approach[0])]
        if self.lower is not None and self.retreat is not None:
            hops += [(self.lift[-1], self.lower[0]), (self.retreat[-1], self.arm.start)]
        motion = sum(float((np.abs(b - a) / speed).max()) for a, b in hops)
        return float((motion + 3.0) / max(self.grasp.quality, 0.05) ** 1.5)
