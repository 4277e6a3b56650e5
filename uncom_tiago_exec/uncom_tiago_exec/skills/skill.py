# SPDX-License-Identifier: Apache-2.0
"""The contract of a skill: how one or several primitives are planned, and how what came of them is judged."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from uncom_common.primitive import Primitive

from uncom_tiago_exec.config import ExecutionConfig
from uncom_tiago_exec.grasping.place_poses import Destination
from uncom_tiago_exec.planning.alternatives import AttemptLog
from uncom_tiago_exec.planning.arm_planner import ArmPlanner
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.scene.scene_model import SceneModel
from uncom_tiago_exec.types import FloatArray, ManipulationTask, Side


class ObjectEnd(Enum):
    """Where the object of a task is once the task is done."""

    IN_HAND = "in_hand"  # nothing is placed, and the arm stays where it holds the object
    UNTOUCHED = "untouched"  # where it was: there is nothing to look at again
    PLACED = "placed"  # on its support, which is looked at again


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """What a skill plans from.

    Attributes:
        task: what is to be done.
        scene: everything on the table, as shapes.
        goal: where the object is to end, or None for a skill that has no destination.
        arms: a planner for each arm, which begins where the arm is now.
        config: of the node.
        avoid: hand poses (4, 4) that failed before.
        like: an earlier plan for nearly the same scene, or None; grasps like its grasp are tried first.
        began_s: processor time of this thread at which planning began [s].
        log: where attempts are recorded.
    """

    task: ManipulationTask
    scene: SceneModel
    goal: Destination | None
    arms: Mapping[Side, ArmPlanner]
    config: ExecutionConfig
    avoid: tuple[FloatArray, ...]
    like: Plan | None
    began_s: float
    log: AttemptLog


class Skill(ABC):
    """One way to manipulate. It has no state: one instance serves every task.

    Attributes:
        primitives: the primitives that it carries out.
        object_end: where the object is afterwards.
        sets_down_held: whether it can begin with the object already in the hand.
        relay_primitive: the primitive that brings the object to the middle of the table, from where the other arm goes
            on; None where that would not help.
    """

    primitives: ClassVar[tuple[Primitive, ...]]
    object_end: ClassVar[ObjectEnd] = ObjectEnd.PLACED
    sets_down_held: ClassVar[bool] = False
    relay_primitive: ClassVar[Primitive | None] = None

    def destination(self, task: ManipulationTask, scene: SceneModel) -> Destination | None:
        """Return where the object is to end, or None if the skill moves it nowhere.

        Raises:
            RefusedError: there is no such place; the text says why.
        """
        return None

    @abstractmethod
    def plan(self, request: PlanRequest) -> Plan:
        """Plan every motion of a task, from where the arms are now to the end.

        Raises:
            RefusedError: it cannot be done; the text says why.
        """

    def expected(self, task: ManipulationTask, plan: Plan) -> tuple[ManipulationTask, Plan]:
        """Return the task and the plan that what is seen afterwards is compared with."""
        return task, plan

    def rests_on_target(self, task: ManipulationTask) -> bool:
        """Tell whether the object must be seen on top of the target afterwards."""
        return False

    def done_text(self, task: ManipulationTask, held: str) -> str:
        """Return what the robot says when it is done; of what was placed it says instead what it sees.

        Args:
            task: what was done.
            held: label of what is in the hand, or empty.
        """
        return f"I have put the {task.object_text or 'object'} down"
