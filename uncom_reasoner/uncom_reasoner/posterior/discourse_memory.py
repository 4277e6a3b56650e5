# SPDX-License-Identifier: Apache-2.0
"""What was spoken of and moved before: for "it", "the other one", "put it back" and corrections."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_common.transforms import FloatArray
from uncom_language.types import Command
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import resolve_antecedent
from uncom_reasoner.types import GroundedCommand, Status


@dataclass(frozen=True, slots=True)
class DiscourseMemory:
    """The last command that was grounded.

    Attributes:
        noun: what "one" stands for.
        detection: the object that was (or is to be) moved; `group` are all of a group.
        places: where those were and went (3,) [m], base frame.
        target: the object that received it, if one did.
        before, goal: poses (4, 4) of the object's footprint centre before, and where it was to go; None if unknown.
        command: its words.
    """

    noun: str = ""
    detection: Detection | None = None
    places: tuple[FloatArray, ...] = ()
    target: Detection | None = None
    before: FloatArray | None = None
    goal: FloatArray | None = None
    command: Command | None = None
    group: tuple[Detection, ...] = ()


def remember(memory: DiscourseMemory, command: Command, grounded: GroundedCommand) -> DiscourseMemory:
    """Return the memory after a command; one that was not grounded changes nothing, parts of a group are added."""
    moved = grounded.object
    if grounded.status is not Status.GROUNDED or moved is None:
        return memory
    places, before = [], None
    if moved.geometry is not None:
        places.append(moved.geometry.centroid)
        before = moved.geometry.pose.copy()
        before[:3, 3] = [*moved.geometry.centroid[:2], before[2, 3] - moved.geometry.size[2] / 2.0]
    if grounded.target.pose is not None:
        places.append(grounded.target.pose[:3, 3])
    earlier = memory if grounded.part > 0 else DiscourseMemory()
    return DiscourseMemory(
        noun=resolve_antecedent(command, memory.noun),
        detection=moved,
        places=(*earlier.places, *places),
        target=grounded.target.detection,
        before=before,
        goal=grounded.target.pose,
        command=command,
        group=(*earlier.group, moved),
    )
