# SPDX-License-Identifier: Apache-2.0
"""The kinds of behaviours that execution trees are made of, and the tree that ran as data.

Behaviours block until they are done and never return RUNNING, so one tick of the root carries out a whole command. An
ExecutionError ends at the behaviour in which it was raised: there it becomes FAILURE, with its text as the feedback
message and the error itself as the `failure` of the state.
"""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence

from uncom_tiago_exec.exceptions import ExecutionError
from uncom_tiago_exec.execution.execution_state import ExecutionState


class StateBehaviour(Behaviour):
    """A behaviour that shares the state of a command, and does not begin once that was stopped."""

    def __init__(self, name: str, state: ExecutionState) -> None:
        """Take the name that reports show, and the state."""
        super().__init__(name)
        self.state = state

    def update(self) -> Status:
        """Do it; see `run`."""
        if self.state.is_stopped:
            self.feedback_message = "not begun: stopped"
            return Status.FAILURE
        try:
            return Status.SUCCESS if self.run() else Status.FAILURE
        except ExecutionError as error:
            self.state.failure = error
            self.feedback_message = str(error)
            return Status.FAILURE

    def run(self) -> bool:
        """Do it, and tell whether it succeeded.

        Raises:
            ExecutionError: it failed; the state keeps why.
        """
        raise NotImplementedError


class Action(StateBehaviour):
    """Does something and succeeds, unless an ExecutionError is raised."""

    def __init__(self, name: str, state: ExecutionState, act: Callable[[], None]) -> None:
        """Take what is to be done."""
        super().__init__(name, state)
        self._act = act

    def run(self) -> bool:
        """Do it; a failure before it counts no more."""
        self._act()
        self.state.failure = None
        return True


class Condition(StateBehaviour):
    """Succeeds if something holds or is found; else the failure before it stays the reason."""

    def __init__(self, name: str, state: ExecutionState, holds: Callable[[], bool]) -> None:
        """Take what tells whether it holds."""
        super().__init__(name, state)
        self._holds = holds

    def run(self) -> bool:
        """Tell whether it holds."""
        return self._holds()


class Recovery(StateBehaviour):
    """Brings the robot back after a failure of given kinds; succeeds if that made good for the failure."""

    def __init__(
        self,
        name: str,
        state: ExecutionState,
        failures: tuple[type[ExecutionError], ...],
        recover: Callable[[ExecutionError], bool],
    ) -> None:
        """Take the kinds of failures, and what is done about one; it tells whether the failure is made good for."""
        super().__init__(name, state)
        self._failures = failures
        self._recover = recover

    def run(self) -> bool:
        """Recover, if the failure is one of those kinds."""
        failure = self.state.failure
        if not isinstance(failure, self._failures):
            self.feedback_message = "not needed"
            return False
        if not self._recover(failure):
            return False
        self.state.failure = None
        return True


def sequence(name: str, *children: Behaviour) -> Sequence:
    """Return what does its children one after the other, until one fails."""
    return Sequence(name, memory=True, children=list(children))


def fallback(name: str, *children: Behaviour) -> Selector:
    """Return what tries its children one after the other, until one succeeds."""
    return Selector(name, memory=True, children=list(children))


def tree_as_data(root: Behaviour) -> dict[str, object]:
    """Return what was ticked of a tree: name, kind and status of each behaviour, and why it failed if that is known."""
    data: dict[str, object] = {"name": root.name, "kind": type(root).__name__, "status": root.status.value}
    if root.feedback_message:
        data["reason"] = root.feedback_message
    ran = [tree_as_data(child) for child in root.children if child.status is not Status.INVALID]
    if ran:
        data["children"] = ran
    return data
