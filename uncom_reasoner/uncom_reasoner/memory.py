# SPDX-License-Identifier: Apache-2.0
"""What was spoken of and moved before: for "it" and "the other one"."""

from __future__ import annotations

from dataclasses import dataclass

from uncom_language.types import Command
from uncom_perception.types import Detection

from uncom_reasoner.phrases import antecedent_of
from uncom_reasoner.types import FloatArray, GroundedCommand, Status


@dataclass(frozen=True, slots=True)
class Memory:
    """The last command that was grounded: its thing, the places (3,) where that was and went, and its target."""

    noun: str = ""
    thing: Detection | None = None
    places: tuple[FloatArray, ...] = ()
    target: Detection | None = None


def remember(memory: Memory, command: Command, grounded: GroundedCommand) -> Memory:
    """Take in a command; one that was not grounded changes nothing."""
    if grounded.status is not Status.GROUNDED or grounded.object is None:
        return memory
    places = []
    if grounded.object.geometry is not None:
        places.append(grounded.object.geometry.centroid)
    if grounded.target.pose is not None:
        places.append(grounded.target.pose[:3, 3])
    return Memory(antecedent_of(command, memory.noun), grounded.object, tuple(places), grounded.target.detection)
