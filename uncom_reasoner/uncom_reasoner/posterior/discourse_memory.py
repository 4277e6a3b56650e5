# SPDX-License-Identifier: Apache-2.0
"""What was spoken of and moved before: for "it", "the other one", "put it back" and corrections."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_language.types import Command
from uncom_perception.types import Detection

from uncom_reasoner.detector_phrases import antecedent_of
from uncom_reasoner.types import FloatArray, GroundedCommand, Status


@dataclass(frozen=True, slots=True)
class Memory:
    """The last command that was grounded.

    Attributes:
        noun: what "one" stands for.
        thing: what was (or is to be) moved; `things` are all of a group.
        places: where those were and went (3,), base frame.
        target: the thing that received it, if one did.
        before, goal: poses (4, 4) of the thing's footprint centre before, and where it was to go; None if unknown.
        command: its words.
    """

    noun: str = ""
    thing: Detection | None = None
    places: tuple[FloatArray, ...] = ()
    target: Detection | None = None
    before: FloatArray | None = None
    goal: FloatArray | None = None
    command: Command | None = None
    things: tuple[Detection, ...] = ()


def remember(memory: Memory, command: Command, grounded: GroundedCommand) -> Memory:
    """Take in a command; one that was not grounded changes nothing. Further parts of a group are added."""
    thing = grounded.object
    if grounded.status is not Status.GROUNDED or thing is None:
        return memory
    places, before = [], None
    if thing.geometry is not None:
        places.append(thing.geometry.centroid)
        before = thing.geometry.pose.copy()
        before[:3, 3] = [*thing.geometry.centroid[:2], before[2, 3] - thing.geometry.size[2] / 2.0]
    if grounded.target.pose is not None:
        places.append(grounded.target.pose[:3, 3])
    earlier: tuple[FloatArray, ...] = memory.places if grounded.part > 0 else ()
    return Memory(
        noun=antecedent_of(command, memory.noun),
        thing=thing,
        places=(*earlier, *places),
        target=grounded.target.detection,
        before=before,
        goal=grounded.target.pose,
        command=command,
        things=(*(memory.things if grounded.part > 0 else ()), thing),
    )
