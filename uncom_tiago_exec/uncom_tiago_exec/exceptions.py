# SPDX-License-Identifier: Apache-2.0
"""Errors of uncom_tiago_exec; every text is one line that can be said to the person."""

from __future__ import annotations

from uncom_common.exceptions import UncomError


class ExecutionError(UncomError):
    """Base of what can go wrong between a grounded command and its motion."""


class RobotModelError(ExecutionError, ValueError):
    """The robot description lacks something that is needed."""


class RefusedError(ExecutionError):
    """The command cannot be carried out, known before anything moves."""


class UnreachableError(RefusedError):
    """No arm reaches the pose, obstacles or not."""


class InCollisionError(RefusedError):
    """The pose can be reached, but only through something; `contacts` names the pairs."""

    def __init__(self, message: str, contacts: tuple[tuple[str, str], ...] = ()) -> None:
        """Take the text and the pairs that touch, as names of links or obstacles."""
        self.contacts = contacts
        super().__init__(message)


class PlanningError(RefusedError):
    """No collision-free way was found in the given time."""


class GraspFailedError(ExecutionError):
    """The fingers closed on nothing, or the object slipped away."""


class MisplacedError(ExecutionError):
    """Looking again, the object is not where it was to be."""


class MotionError(ExecutionError):
    """A controller refused, aborted or did not answer."""


class StoppedError(ExecutionError):
    """The motion was stopped on request."""
