# SPDX-License-Identifier: Apache-2.0
"""The one state object that the behaviours of a command share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from uncom_tiago_exec.exceptions import ExecutionError, StoppedError
from uncom_tiago_exec.execution.base_approach import Approach, Relay
from uncom_tiago_exec.planning.plan import Plan
from uncom_tiago_exec.types import FloatArray, ManipulationTask


class PlanUnderWay(NamedTuple):
    """A plan that was begun, and the task that it was made for (in odom)."""

    plan: Plan
    task: ManipulationTask


@dataclass(slots=True)
class ExecutionState:
    """What behaviours know and change. Tasks are in odom.

    Attributes:
        task: the command, with everything where it is known to be.
        current: what the present attempt is to do: the task as it is seen now, or a part of it.
        under_way: the plan that was begun last, by this command or an earlier one.
        unfinished: the plan whose arm may have been left elsewhere than at home by the last command.
        own_parts: ids of detections that are the robot itself, or in its hand.
        begins_holding: whether something is in the hand when the task is begun.
        held: the plan that has put it there.
        plan: what was planned for `current`.
        approach: by how much to drive nearer, and the plan from there.
        next_drive: index of the shortest drive that may be tried yet.
        relay: the two halves of the way by the middle of the table.
        places: places (2,) where what is held may be put back, in the order in which they are tried.
        failed_grasps: hand poses (4, 4) of the attempts that failed.
        refusal: why it could not be done from where the base stands.
        failure: what the last behaviour failed with; None once one succeeded.
        text: what is said at the end.
    """

    task: ManipulationTask
    current: ManipulationTask
    under_way: PlanUnderWay | None = None
    unfinished: Plan | None = None
    own_parts: frozenset[str] = frozenset()
    begins_holding: bool = False
    held: Plan | None = None
    plan: Plan | None = None
    approach: Approach | None = None
    next_drive: int = 1
    relay: Relay | None = None
    places: list[FloatArray] = field(default_factory=list)
    failed_grasps: list[FloatArray] = field(default_factory=list)
    refusal: ExecutionError | None = None
    failure: ExecutionError | None = None
    text: str = ""

    @property
    def is_stopped(self) -> bool:
        """Whether the command was stopped: no behaviour begins any more."""
        return isinstance(self.failure, StoppedError)
