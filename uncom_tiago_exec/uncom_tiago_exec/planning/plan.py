# SPDX-License-Identifier: Apache-2.0
"""The plan of a whole manipulation: steps that are executed one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from uncom_tiago_exec.grasping.grasps import Grasp
from uncom_tiago_exec.planning.alternatives import Attempt, attempts_as_data
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import ODOM_ORIGIN, BasePose, FloatArray, Side, Stage, Trajectory


@dataclass(frozen=True, slots=True)
class MoveStep:
    """Follow a trajectory of torso and arm.

    Attributes:
        stage: of the execution.
        trajectory: to follow.
        detail: what it is for, in words.
        shortest_s: least time from its start to its end under the same limits, along any path [s].
    """

    stage: Stage
    trajectory: Trajectory
    detail: str = ""
    shortest_s: float = 0.0


@dataclass(frozen=True, slots=True)
class GripStep:
    """Move the fingers to a gap.

    Attributes:
        stage: of the execution.
        gap: between the fingers [m].
        holding: whether an object is expected between them; the gap is then less than its width.
        detail: what it is for, in words.
    """

    stage: Stage
    gap: float
    holding: bool = False
    detail: str = ""


Step = MoveStep | GripStep


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps for one arm, to be executed in order; all poses are in base_footprint with the base at `base`.

    Attributes:
        side: of the arm that moves.
        steps: motions and grips.
        scene: that it was planned in.
        grasp: by which the object is taken; None if nothing is grasped.
        motion: of the object (4, 4), from its pose before to that after; None if it is not placed.
        planning_s: wall time of the planning [s].
        timings_s: processor time of its parts by name [s].
        attempts: alternatives that were tried.
        base: pose of the base in odom that it was planned for.
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
        """Duration of the motions, without those of the fingers [s]."""
        return sum(step.trajectory.duration_s for step in self.steps if isinstance(step, MoveStep))

    @property
    def shortest_s(self) -> float:
        """Sum of the least times of the motions, each from rest to rest [s]."""
        return sum(step.shortest_s for step in self.steps if isinstance(step, MoveStep))

    def as_data(self) -> dict[str, object]:
        """Return the plan as data for reports: times [s], attempts by stage, and the grasp [m]."""
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
        """The joint vector (8,) at the start of its first motion, to which the arm returns."""
        return next(step.trajectory.positions[0] for step in self.steps if isinstance(step, MoveStep))

    @property
    def lifted(self) -> FloatArray | None:
        """The joint vector (8,) at which the object is first held clear of everything; None if there is none."""
        moves = [step for step in self.steps if isinstance(step, MoveStep)]
        ends = [step.trajectory.positions[-1] for step in moves if step.stage == Stage.LIFTING]
        starts = [step.trajectory.positions[0] for step in moves if step.stage == Stage.TRANSFERRING]
        return next(iter([*ends[-1:], *starts]), None)
