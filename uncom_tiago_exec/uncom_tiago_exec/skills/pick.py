# SPDX-License-Identifier: Apache-2.0
"""Picking: the object is taken and kept in the hand."""

from __future__ import annotations

from typing import ClassVar

from uncom_common.primitive import Primitive

from uncom_tiago_exec.planning.plan import Step
from uncom_tiago_exec.skills.grasping_skill import GraspingSkill
from uncom_tiago_exec.skills.motion_steps import Reach, taking_steps
from uncom_tiago_exec.skills.skill import ObjectEnd
from uncom_tiago_exec.types import ManipulationTask


class PickSkill(GraspingSkill):
    """Takes an object and holds it where it was lifted to."""

    primitives: ClassVar[tuple[Primitive, ...]] = (Primitive.PICK,)
    object_end: ClassVar[ObjectEnd] = ObjectEnd.IN_HAND

    def steps(self, reach: Reach, task: ManipulationTask, *, strict: bool) -> tuple[Step, ...]:
        """Return the steps to the lifted object."""
        return taking_steps(reach)

    def done_text(self, task: ManipulationTask, held: str) -> str:
        """Return what the robot says."""
        return f"I hold the {held}"
