# SPDX-License-Identifier: Apache-2.0
"""A whole manipulation as steps that can be carried out one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning.alternatives import Attempt, attempts_as_data
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import ODOM_ORIGIN, BasePose, FloatArray, Side, Stage, Trajectory


@dataclass(frozen=True, slots=True)
class MoveStep:
    """Follow a trajectory of torso and arm."""

    stage: Stage
    trajectory: Trajectory
    detail: str = ""
    shortest_s: float = 0.0  # least time from its start to its end under the same limits, whatever the way


@dataclass(frozen=True, slots=True)
class GripStep:
    """Bring the fingers to a gap [m]; `holding` expects something between them and aims below its width."""

    stage: Stage
    gap: float
    holding: bool = False
    detail: str = ""


Step = MoveStep | GripStep


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps for one arm, to be carried out in order; everything is in base_footprint with the base at `base`.

    side: arm that moves; steps: motions and grips; scene: what it was planned in; grasp: None where nothing is taken.
    motion (4, 4): what the placing does to the object, from its pose before to that after; None if it is not placed.
    planning_s: wall time of the planning [s]; timings_s: processor time of its parts [s], by name.
    attempts: what was tried on the way to this plan; base: pose of the base in odom that it was planned for.
    """

    side: Side
    steps: tuple[Step, ...]
    scene: SceneModel
    grasp: Grasp | None = None
    motion: FloatArray | None = None
    planning_s: float = 0.0
    timings_s: dict[str, float] = field(default_factory=dict)
    attempts: tuple[Attempt, ...] = ()
    base: BasePose = ODOM_ORIGIN

    @property
    def duration_s(self) -> float:
        """Time in motion, without the grippers [s]."""
        return sum(step.trajectory.duration_s for step in self.steps if isinstance(step, MoveStep))

    @property
    def shortest_s(self) -> float:
        """Sum of the least times of the motions [s], each from rest to rest."""
        return sum(step.shortest_s for step in self.steps if isinstance(step, MoveStep))

    def as_data(self) -> dict[str, object]:
        """Return what is told of a plan: times [s], what was tried in each stage, and the grasp [m]."""
        data: dict[str, object] = {
            "planning_s": round(self.planning_s, 4),
            "timings_s": self.timings_s,
            "motion_s": round(self.duration_s, 3),
            "stages": attempts_as_data(self.attempts),
        }
        if self.grasp is not None:
            data["grasp"] = {
                "family": self.grasp.family,
                "quality": round(self.grasp.quality, 3),
                "width_m": round(self.grasp.width, 4),
                "opening_m": round(self.grasp.opening, 4),
                "pose": np.round(self.grasp.pose, 4).tolist(),
            }
        return data

    @property
    def home(self) -> FloatArray:
        """Where its first motion begins: the joint vector (8,) to go back to."""
        return next(step.trajectory.positions[0] for step in self.steps if isinstance(step, MoveStep))

    @property
    def lifted(self) -> FloatArray | None:
        """Where it first has the object in the hand and clear of everything: a joint vector (8,), or None."""
        moves = [step for step in self.steps if isinstance(step, MoveStep)]
        ends = [step.trajectory.positions[-1] for step in moves if step.stage == Stage.LIFTING]
        starts = [step.trajectory.positions[0] for step in moves if step.stage == Stage.TRANSFERRING]
        return next(iter([*ends[-1:], *starts]), None)
